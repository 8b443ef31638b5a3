"""A reference map in place of a truth that is not known."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rayvox.collision_checker import CollisionChecker
from rayvox.map_snapshot import MapSnapshot
from rayvox.robot import Robot
from rayvox.tune.ground_truth import (
    ROBOT_COLLIDES,
    ROBOT_FREE,
    ROBOT_UNDECIDED,
    FloatArray,
    NearestPoint,
    occupied_centres,
)
from rayvox.tune.scene_truth import SAMPLES


class MapTruth:
    """GroundTruth of a map of the same scans, at a finer resolution and with every ray inserted exactly.

    It shares the scans' noise and wrong poses, so that what is measured against it is what the settings add.
    """

    def __init__(self, reference: MapSnapshot, seed: int = 0) -> None:
        self._reference = reference
        rng = np.random.default_rng(seed)
        centres = occupied_centres(reference)
        self._surface = NearestPoint(centres)
        self.seen_surface = centres[rng.permutation(len(centres))[:SAMPLES]]
        self.seen_free = _points_of_free_leaves(reference, SAMPLES, rng)

    def distance_m(self, points: FloatArray) -> FloatArray:
        return self._surface.distance_m(points)

    def holds_surface(self, centres: FloatArray, edge_m: float) -> npt.NDArray[np.bool_]:
        # Shrunk by rounding: cells that only share a face with something occupied hold nothing of it.
        half = 0.5 * edge_m * (1 - 1e-9)
        held: npt.NDArray[np.bool_] = self._reference.box_states(centres - half, centres + half) == 2
        return held

    def robot_states(self, robot: Robot, configurations: FloatArray, T_map_base: FloatArray) -> npt.NDArray[np.uint8]:
        """Undecided where the robot meets nothing occupied, but space that no ray passed."""
        verdicts = CollisionChecker(self._reference, robot, "occupied").check(configurations, T_map_base).verdicts
        return np.array([ROBOT_FREE, ROBOT_COLLIDES, ROBOT_UNDECIDED], dtype=np.uint8)[verdicts]


def _points_of_free_leaves(octree: MapSnapshot, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 3) uniform in the free volume."""
    keys, depth, log_odds = octree.leaves()
    free = log_odds < octree.sensor_model.native.occupied_log_odds
    wide = np.ldexp(1.0, octree.depth - depth[free].astype(np.int64))
    if not len(wide):
        return np.zeros((0, 3))
    chosen = rng.choice(len(wide), count, p=wide**3 / (wide**3).sum())
    points: FloatArray = (keys[free][chosen] + rng.random((count, 3)) * wide[chosen, None]) * octree.resolution_m
    return points
