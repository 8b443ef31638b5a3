"""Which rays are kept."""

from __future__ import annotations

import numpy as np
import pytest
from rayvox.ray_sampling import kept_rays


@pytest.mark.parametrize("share", [0.01, 0.25, 0.5, 0.9])
@pytest.mark.parametrize("step", [1, 2, 64, 320])
def test_the_share_is_kept_of_all_rays_and_of_every_row_ring_and_column(share: float, step: int) -> None:
    kept = kept_rays(200_000, share)
    for start in range(min(step, 8)):
        assert abs(kept[start::step].mean() - share) < 0.02


def test_all_are_kept_by_a_share_of_one_and_one_by_the_smallest() -> None:
    assert kept_rays(10_000, 1.0).all()
    assert kept_rays(1, 1e-9).all()


def test_the_choice_is_the_same_for_ever() -> None:
    assert np.flatnonzero(kept_rays(20, 0.25)).tolist() == KEPT_OF_TWENTY


KEPT_OF_TWENTY = [0, 2, 5, 10, 13, 18]
