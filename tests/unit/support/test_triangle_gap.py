"""The oracle of collision verdicts at the extremes against known gaps and against plain float64."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.separating_axes import separation
from tests.support.triangle_gap import mesh_gaps, triangle_gaps

FLOOR = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype=np.float64)


def test_gaps_of_triangles_with_an_area_are_those_of_plain_float64() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 500, 3, 3))
    b += rng.normal(size=(500, 1, 3))
    expected = separation(a, b)
    found = triangle_gaps(a, b).astype(np.float64)
    # More axes never separate what touches, and may find a wider gap where an edge or a corner is nearest.
    assert ((found > 0) == (expected > 0)).all()
    assert (found >= expected - 1e-12).all()
    assert 100 < (found > 0).sum() < 480


@pytest.mark.parametrize("scale", [1e-60, 1.0, 1e9])
@pytest.mark.parametrize(
    ("other", "gap"),
    [
        ([[1, 1, 0.25]] * 3, 0.25),
        ([[-3, 4, 0]] * 3, 3.0),
        ([[-1, 0, 0], [-1, 1, 0], [-1, 0.5, 0]], 1.0),
        ([[1, 1, 0.5], [1, 2, 0.5], [1, 1.5, 0.5]], 0.5),
        ([[5, 0, 0], [9, 0, 0], [7, 0, 0]], 1.0),
        ([[7, 4, 0]] * 3, 3.5 * 2**0.5),
    ],
)
def test_segments_and_points_have_their_distance(scale: float, other: list[list[float]], gap: float) -> None:
    b = np.array(other, dtype=np.float64)
    found = triangle_gaps(FLOOR[None] * scale, b[None] * scale)[0]
    assert float(found) == pytest.approx(gap * scale, rel=1e-12)


def test_a_meshs_gap_is_that_of_its_nearest_pair() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(6, 3, 3)) * 0.3, rng.normal(size=(5, 3, 3)) * 0.3
    poses = np.tile(np.eye(4), (40, 1, 1))
    poses[:, :3, 3] = rng.normal(size=(40, 3))
    for pose, found in zip(poses, mesh_gaps(a, b, poses), strict=True):
        moved = b + pose[:3, 3]
        every = triangle_gaps(np.repeat(a, len(b), axis=0), np.tile(moved, (len(a), 1, 1)))
        assert (found <= 0) == (float(every.min()) <= 0)
        assert found >= float(every.min()) - 1e-9
        if found <= 1e-3:
            assert found == pytest.approx(float(every.min()), abs=1e-15)
