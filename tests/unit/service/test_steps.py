"""Long queries in steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import pytest
from rayvox_service.steps import STEP_S, Pace, Steps, Unfinished, advance, in_batches, joined

T = TypeVar("T")


@dataclass
class Answers:
    values: npt.NDArray[np.int64]
    revision: int
    extra: npt.NDArray[np.int64] | None = None


def finish(steps: Steps[T]) -> tuple[T, int]:
    """The answer, and how many steps it took."""
    count = 1
    while isinstance(answer := advance(steps), Unfinished):
        count += 1
    return answer, count


@pytest.mark.parametrize("count", [0, 1, 4, 5, 1000])
def test_every_row_is_done_once_and_in_order(count: int) -> None:
    rows = np.arange(count)
    answers, steps = finish(in_batches(count, lambda part: Answers(rows[part], 7), first_rows=4))
    assert joined(answers).values.tolist() == rows.tolist()
    assert joined(answers).revision == 7
    assert joined(answers).extra is None
    assert steps == len(answers) >= (2 if count > 4 else 1)


def test_a_step_that_took_too_long_is_followed_by_a_smaller_one_and_a_quick_one_by_a_larger(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = 0.0
    monkeypatch.setattr("rayvox_service.steps.time.perf_counter", lambda: now_s)
    pace, sizes = Pace(64), []
    for step_s in (STEP_S / 2, STEP_S / 1000, 4 * STEP_S, 1e6 * STEP_S, STEP_S):
        with pace.step() as rows:
            sizes.append(rows)
            now_s += step_s
    assert sizes == [64, 128, 1024, 256, 1]


def test_an_error_in_a_step_comes_out_of_it() -> None:
    def refuse(part: slice) -> Answers:
        raise ValueError(part.start)

    with pytest.raises(ValueError, match="0"):
        finish(in_batches(10, refuse, first_rows=4))
