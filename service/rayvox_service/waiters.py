"""Futures that wait for a counter (a sequence, a revision) to reach a value."""

from __future__ import annotations

import heapq
import itertools
import threading
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from typing import TypeVar

T = TypeVar("T")


class Waiters:
    """Thread-safe. The counter only grows; a waiter gets the counter's value once it is at least what was asked."""

    def __init__(self, value: int) -> None:
        self._lock = threading.Lock()
        self._value = value
        self._tie_breaker = itertools.count()
        self._waiting: list[tuple[int, int, Future[int]]] = []
        self._failure: Exception | None = None

    @property
    def value(self) -> int:
        return self._value

    def reached(self, value: int) -> Future[int]:
        """A future of the counter at the moment it is >= value; cancelled futures cost nothing later."""
        future: Future[int] = Future()
        with self._lock:
            if self._failure is not None:
                future.set_exception(self._failure)
            elif self._value >= value:
                future.set_result(self._value)
            else:
                self._waiting = [entry for entry in self._waiting if not entry[2].cancelled()]
                heapq.heapify(self._waiting)
                heapq.heappush(self._waiting, (value, next(self._tie_breaker), future))
        return future

    def advance(self, value: int) -> None:
        due: list[Future[int]] = []
        with self._lock:
            self._value = value
            while self._waiting and self._waiting[0][0] <= value:
                due.append(heapq.heappop(self._waiting)[2])
        for future in due:
            settle(future, value)

    def fail(self, error: Exception) -> None:
        """Fails all waiters, now and from now on."""
        with self._lock:
            self._failure = error
            due, self._waiting = [entry[2] for entry in self._waiting], []
        for future in due:
            settle_error(future, error)


def settle(future: Future[T], value: T) -> None:
    """Set a result unless the waiter has gone."""
    with suppress(InvalidStateError):
        future.set_result(value)


def settle_error(future: Future[T], error: Exception) -> None:
    with suppress(InvalidStateError):
        future.set_exception(error)
