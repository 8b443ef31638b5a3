"""A tight capsule around points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

NO_CAPSULE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0])
NO_CAPSULE.flags.writeable = False
# Grows the radius beyond all rounding of the fit.
_ROUNDING = 1e-9


def bounding_capsule(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(7,): two ends and a radius. The smallest by volume along the points' principal axes and the frame's own."""
    axes = np.vstack([np.eye(3), np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]])
    capsules = [_capsule_along(points, axis) for axis in axes]
    return min(capsules, key=_volume)


def _capsule_along(points: npt.NDArray[np.float64], axis: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    # Any two directions across the axis give a centre line; the middle of the points' extent is a good one.
    across = np.linalg.svd(axis[None, :])[2][1:]
    flat = points @ across.T
    centre = (flat.min(axis=0) + flat.max(axis=0)) / 2
    away = np.linalg.norm(flat - centre, axis=1)
    radius = away.max()
    along, cap = points @ axis, np.sqrt(np.maximum(radius**2 - away**2, 0.0))
    # Each point needs the far end beyond along - cap, and the near end before along + cap.
    near, far = float((along + cap).min()), float((along - cap).max())
    if near > far:
        near = far = (near + far) / 2
    base = centre @ across
    scale = float(np.abs(points).max()) + radius
    return np.concatenate([base + near * axis, base + far * axis, [radius + _ROUNDING * scale]])


def _volume(capsule: npt.NDArray[np.float64]) -> float:
    length, radius = np.linalg.norm(capsule[3:6] - capsule[:3]), capsule[6]
    return float(radius**2 * (length + 4 / 3 * radius))
