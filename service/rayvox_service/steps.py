"""Long queries as steps, between which others get their turn and the query can be given up."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
from rayvox import CancellationToken

T = TypeVar("T")
A = TypeVar("A")

# What a step may take, so that a short query waits no longer behind a long one.
STEP_S = 0.02
MOST_GROWTH = 8.0

# Every `yield` is a place where others come in; the value returned is the answer.
Steps = Generator[None, None, T]
CancellableSteps = Callable[[CancellationToken], Steps[T]]


class Unfinished:
    """What `advance` returns while steps are left."""


UNFINISHED = Unfinished()


def advance(steps: Steps[T]) -> T | Unfinished:
    """Do the next step; the answer after the last one."""
    try:
        next(steps)
    except StopIteration as end:
        answer: T = end.value
        return answer
    return UNFINISHED


class Pace:
    """How many rows the next step takes: as many as STEP_S allowed for in the step before."""

    def __init__(self, first_rows: int) -> None:
        self.rows = first_rows

    @contextmanager
    def step(self) -> Iterator[int]:
        """The rows to do within the block."""
        started = time.perf_counter()
        yield self.rows
        took_s = max(time.perf_counter() - started, 1e-6)
        self.rows = max(1, int(self.rows * min(STEP_S / took_s, MOST_GROWTH)))


def in_batches(count: int, batch: Callable[[slice], A], first_rows: int) -> Steps[list[A]]:
    """`batch` of consecutive rows until `count` are done, once where there are none; `first_rows` in the first step."""
    answers: list[A] = []
    pace, begin = Pace(first_rows), 0
    while True:
        with pace.step() as rows:
            answers.append(batch(slice(begin, begin + rows)))
        begin += rows
        if begin >= count:
            return answers
        yield


def joined(answers: list[A]) -> A:
    """Dataclasses of arrays with one row per question, one after the other; all else is as in the first."""
    first: Any = answers[0]
    if len(answers) == 1:
        return answers[0]
    changed: dict[str, Any] = {}
    for field in fields(first):
        values = [getattr(answer, field.name) for answer in answers]
        if isinstance(values[0], np.ndarray):
            changed[field.name] = np.concatenate(values)
    whole: A = replace(first, **changed)
    return whole
