"""Who is on the front, and who beats the others."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rayvox.tune.pareto import coarse, dominators

costs_tables = arrays(np.float64, st.tuples(st.integers(1, 25), st.integers(1, 4)), elements=st.integers(0, 4))


def beats(one: np.ndarray, other: np.ndarray) -> bool:
    return all(a <= b for a, b in zip(one, other, strict=True)) and any(a < b for a, b in zip(one, other, strict=True))


@given(costs_tables)
def test_the_front_is_what_nothing_beats_and_the_others_name_one_of_it_that_does(costs: np.ndarray) -> None:
    found = dominators(costs)
    for row, by in enumerate(found):
        beaten = any(beats(other, costs[row]) for other in costs)
        assert (by is not None) == beaten
        if by is not None:
            assert beats(costs[by], costs[row])
            assert found[by] is None


def test_equal_costs_do_not_dominate_each_other() -> None:
    assert dominators(np.array([[1.0, 2.0], [1.0, 2.0]])) == [None, None]


def test_times_that_differ_by_what_they_repeat_with_are_the_same() -> None:
    assert coarse(1.0e-3) == coarse(1.02e-3)
    assert coarse(1.0e-3) < coarse(1.2e-3)
