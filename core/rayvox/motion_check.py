"""Motions between configurations, without a collision that slips between samples.

Adaptive bisection with motion bounds (Schwarzer, Saha, Latombe: Adaptive dynamic collision checking for single and
multiple articulated robots in complex environments, IEEE T-RO 2005): on an interval of the motion no point of a link
is farther from where it is in the middle than half of the link's path. So where the robot in the middle, each link
grown by that much, is free, the whole interval is; other intervals are halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError
from rayvox.robot.robot import Robot

FloatArray = npt.NDArray[np.float64]
# Verdicts of (n, links, 4, 4) poses with links grown by (n, links) metres.
PaddedCheck = Callable[[FloatArray, FloatArray], npt.NDArray[np.uint8]]
# More than what rounding takes from a configuration's place on its motion.
_ROUNDING_M = 1e-9


@dataclass(frozen=True)
class MotionCheck:
    """Answers to n motions."""

    verdicts: npt.NDArray[np.uint8]
    """(n,): CollisionVerdict of where the motion first collides, or comes within the tolerance; FREE if nowhere."""
    free_until: FloatArray
    """(n,): the motion is free from parameter 0 up to this one, 1 where all of it is."""
    tolerance_m: float
    """A motion that is not free comes within this of a voxel that counts, along each axis of the map."""


@dataclass
class _Intervals:
    motion: npt.NDArray[np.intp]
    begin: FloatArray
    length: float  # all halved as often

    def where(self, chosen: npt.NDArray[np.bool_]) -> _Intervals:
        return _Intervals(self.motion[chosen], self.begin[chosen], self.length)

    def halves(self) -> _Intervals:
        half = self.length / 2
        begin = np.column_stack([self.begin, self.begin + half]).ravel()
        return _Intervals(np.repeat(self.motion, 2), begin, half)


def check_motions(
    robot: Robot,
    q_from: npt.ArrayLike,
    q_to: npt.ArrayLike,
    T_map_base: npt.ArrayLike | None,
    tolerance_m: float,
    check: PaddedCheck,
) -> MotionCheck:
    """As CollisionChecker.check_motion, whose `check` says what collides."""
    if not 0 < tolerance_m < np.inf:
        raise InvalidInputError(f"tolerance_m = {tolerance_m!r} is not a finite number above zero")
    bounds_m = robot.motion_bounds(q_from, q_to, T_map_base)
    start, end = np.broadcast_arrays(*(np.atleast_2d(np.asarray(q, dtype=np.float64)) for q in (q_from, q_to)))
    result = MotionCheck(np.zeros(len(start), dtype=np.uint8), np.ones(len(start)), tolerance_m)
    open_intervals = _Intervals(np.arange(len(start)), np.zeros(len(start)), 1.0)
    while len(open_intervals.motion):
        middle = (open_intervals.begin + 0.5 * open_intervals.length)[:, None]
        q = start[open_intervals.motion] * (1 - middle) + end[open_intervals.motion] * middle
        grown_m = 0.5 * open_intervals.length * bounds_m[open_intervals.motion] + _ROUNDING_M
        verdicts = check(robot.link_poses(q, T_map_base), grown_m)
        # At the tolerance an interval is not halved any more: what still collides is taken for a collision.
        smallest = grown_m.max(axis=1) <= tolerance_m
        _keep_first(result, open_intervals.where(smallest & (verdicts != 0)), verdicts[smallest & (verdicts != 0)])
        before_first = open_intervals.begin < result.free_until[open_intervals.motion]
        open_intervals = open_intervals.where(~smallest & (verdicts != 0) & before_first).halves()
    return result


def _keep_first(result: MotionCheck, colliding: _Intervals, verdicts: npt.NDArray[np.uint8]) -> None:
    for motion, begin, verdict in zip(colliding.motion, colliding.begin, verdicts, strict=True):
        if begin < result.free_until[motion]:
            result.free_until[motion], result.verdicts[motion] = begin, verdict
