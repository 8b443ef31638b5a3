"""Motions between configurations, without a collision that slips between samples.

Adaptive bisection with motion bounds (Schwarzer, Saha, Latombe: Adaptive dynamic collision checking for single and
multiple articulated robots in complex environments, IEEE T-RO 2005): on an interval of the motion no point of a link
is farther from where it is in the middle than half of the link's path. So where the robot in the middle, each link
grown by that much, is free, the whole interval is; other intervals are halved.

Joints move at constant speed; the base too, its origin on a straight line while it turns about one axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError
from rayvox.robot.configurations import as_configurations, as_poses
from rayvox.robot.robot import Robot
from rayvox.robot.turning import turned

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


@dataclass(frozen=True)
class PathCheck:
    """Answer to a path through m waypoints."""

    verdict: int
    """CollisionVerdict of where the path first collides, or comes within the tolerance; FREE if nowhere."""
    free_until: float
    """The path is free from waypoint 0 up to here: 2.25 is a quarter of the way from waypoint 2 to 3; m - 1 where all
    of it is."""
    tolerance_m: float
    """As MotionCheck's."""


@dataclass(frozen=True)
class Motions:
    """n motions of a robot: (n, j) values of its joints and (n or 1, 4, 4) poses of its base at both ends."""

    q_from: FloatArray
    q_to: FloatArray
    T_map_base_from: FloatArray
    T_map_base_to: FloatArray

    @classmethod
    def between(
        cls, robot: Robot, q: tuple[npt.ArrayLike | None, ...], T_map_base: tuple[npt.ArrayLike | None, ...]
    ) -> Motions:
        """From two configurations and two base poses, or arrays of them.

        Of poses None is the identity, and as the second one a base that rests. Raises InvalidInputError.
        """
        T_from = as_poses(T_map_base[0], "T_map_base")
        T_to = T_from if T_map_base[1] is None else as_poses(T_map_base[1], "T_map_base_to")
        ends = [*(as_configurations(value, len(robot.joint_names), 1) for value in q), T_from, T_to]
        counts = [len(end) for end in ends]
        if any(count not in (1, max(counts)) for count in counts):
            raise InvalidInputError(f"{counts[:2]} configurations and {counts[2:]} base poses make no motions")
        return cls(*(np.broadcast_to(end, (max(counts), *end.shape[1:])) for end in ends))

    def at(self, motion: npt.NDArray[np.intp], parameter: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(k, j) configurations and (k, 4, 4) base poses of k of the motions at a parameter in 0 to 1 each."""
        t = parameter[:, None]
        q = self.q_from[motion] * (1 - t) + self.q_to[motion] * t
        T_from, T_to = self.T_map_base_from[motion], self.T_map_base_to[motion]
        T = T_from.copy()
        T[:, :3, 3] = T_from[:, :3, 3] * (1 - t) + T_to[:, :3, 3] * t
        turning = (T_from[:, :3, :3] != T_to[:, :3, :3]).any(axis=(1, 2))
        T[turning, :3, :3] = turned(T_from[turning, :3, :3], T_to[turning, :3, :3], parameter[turning])
        return q, T


def check_motions(robot: Robot, motions: Motions, tolerance_m: float, check: PaddedCheck) -> MotionCheck:
    """As CollisionChecker.check_motion, whose `check` says what collides."""
    if not 0 < tolerance_m < np.inf:
        raise InvalidInputError(f"tolerance_m = {tolerance_m!r} is not a finite number above zero")
    bounds_m = robot.motion_bounds(motions.q_from, motions.q_to, motions.T_map_base_from, motions.T_map_base_to)
    count = len(motions.q_from)
    result = MotionCheck(np.zeros(count, dtype=np.uint8), np.ones(count), tolerance_m)
    open_intervals = _Intervals(np.arange(count), np.zeros(count), 1.0)
    while len(open_intervals.motion):
        placed = motions.at(open_intervals.motion, open_intervals.begin + 0.5 * open_intervals.length)
        grown_m = 0.5 * open_intervals.length * bounds_m[open_intervals.motion] + _ROUNDING_M
        verdicts = check(robot.link_poses(*placed), grown_m)
        # At the tolerance an interval is not halved any more: what still collides is taken for a collision.
        smallest = grown_m.max(axis=1) <= tolerance_m
        _keep_first(result, open_intervals.where(smallest & (verdicts != 0)), verdicts[smallest & (verdicts != 0)])
        before_first = open_intervals.begin < result.free_until[open_intervals.motion]
        open_intervals = open_intervals.where(~smallest & (verdicts != 0) & before_first).halves()
    return result


def first_of_path(result: MotionCheck) -> PathCheck:
    """Where a path first collides whose pieces, in order, are these motions."""
    colliding = np.flatnonzero(result.verdicts)
    if len(colliding) == 0:
        return PathCheck(0, float(len(result.verdicts)), result.tolerance_m)
    first = int(colliding[0])
    return PathCheck(int(result.verdicts[first]), first + float(result.free_until[first]), result.tolerance_m)


def _keep_first(result: MotionCheck, colliding: _Intervals, verdicts: npt.NDArray[np.uint8]) -> None:
    for motion, begin, verdict in zip(colliding.motion, colliding.begin, verdicts, strict=True):
        if begin < result.free_until[motion]:
            result.free_until[motion], result.verdicts[motion] = begin, verdict
