"""The bound keeps what it promises."""

from __future__ import annotations

import numpy as np
from rayvox.tune.prediction import upper_bound


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
