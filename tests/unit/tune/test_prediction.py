"""The bound keeps what it promises."""

from __future__ import annotations

import numpy as np
from rayvox.tune.prediction import error_bound, upper_bound


def test_two_measurements_bound_nothing() -> None:
    assert upper_bound([0.05, 0.05]) is None


def test_equal_measurements_are_their_own_bound() -> None:
    bound = upper_bound([0.05] * 5)
    assert bound is not None
    np.testing.assert_allclose(bound, 0.05)


def test_the_next_measurement_stays_below_the_bound_99_times_in_a_hundred() -> None:
    rng = np.random.default_rng(0)
    for parts in (3, 6, 12, 30):
        errors = np.exp(rng.normal(-3.0, 0.2, (4000, parts + 1)))
        kept = np.mean([row[-1] <= (upper_bound(row[:-1].tolist()) or 0.0) for row in errors])
        assert abs(kept - 0.99) < 0.006


def test_a_tail_that_nearly_counts_on_one_part_raises_the_bound() -> None:
    p95 = [0.031, 0.033, 0.032, 0.034]
    assert error_bound(p95, [0.035, 0.04, 0.036, 0.04]) == max(0.04, upper_bound(p95) or 0.0)
    assert error_bound(p95, [0.035, 0.04, 0.45, 0.04]) == 0.45
    assert error_bound(p95[:2], [0.05, 0.05]) is None
