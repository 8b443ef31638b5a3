"""What is lost on the way through a file."""

from __future__ import annotations

import numpy as np
from rayvox import SensorModel
from rayvox.tune.candidate import MapSettings
from rayvox.tune.storage import STORAGE_FORMS, eight_bit_log_odds, measure_storage

from tests.support.tuning_input import small_part


def test_float32_forms_lose_nothing_and_likelihoods_do() -> None:
    figures = [measure_storage(small_part(1, stations=6), MapSettings(0.2), form) for form in STORAGE_FORMS]
    nodes, ot, eight_bits, bt = figures
    for exact in (nodes, ot):
        assert (exact.changed_states, exact.log_odds_error) == (0.0, 0.0)
    assert 0 < eight_bits.log_odds_error < 0.2
    assert bt.log_odds_error > eight_bits.log_odds_error
    assert bt.bytes_per_map < eight_bits.bytes_per_map < ot.bytes_per_map


def test_eight_bits_move_log_odds_by_half_a_level_at_most() -> None:
    model = SensorModel()
    low, high = model.native.clamp_min_log_odds, model.native.clamp_max_log_odds
    values = np.random.default_rng(0).uniform(low, high, 10_000).astype(np.float32)
    moved = eight_bit_log_odds(values, model)
    assert len(np.unique(moved)) <= 255
    assert np.abs(moved - values).max() <= (high - low) / 254 / 2 + 1e-6
    order = np.argsort(values, kind="stable")
    assert (np.diff(moved[order]) >= 0).all()
