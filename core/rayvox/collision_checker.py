"""Collision queries of a robot against a map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox._native import CancellationToken
from rayvox.clearance import Clearance, clearance_of
from rayvox.errors import InvalidInputError
from rayvox.map_snapshot import MapSnapshot
from rayvox.motion_check import MotionCheck, Motions, PathCheck, check_motions, first_of_path
from rayvox.robot.robot import Robot
from rayvox.self_collision import self_collisions
from rayvox.sensor_model import SensorModel

UnknownPolicy = Literal["free", "occupied"]


class CollisionVerdict(IntEnum):
    """What CollisionCheck.verdicts says of a pose."""

    FREE = 0
    OCCUPIED = 1
    UNKNOWN = 2


@dataclass(frozen=True)
class VoxelContacts:
    """Voxels that links touch or enclose, m of them, by pose and link; leaves of the pruned octree."""

    pose: npt.NDArray[np.int64]
    """(m,): index of the pose, ascending."""
    link: npt.NDArray[np.int64]
    """(m,): index of the link in Robot.links."""
    centre_m: npt.NDArray[np.float64]
    """(m, 3): centre of the voxel, map frame, metres."""
    size_m: npt.NDArray[np.float64]
    """(m,): edge of the voxel, metres."""
    log_odds: npt.NDArray[np.float32]
    """(m,): NaN where the voxel is unknown."""


@dataclass(frozen=True)
class CollisionCheck:
    """Answers to n poses, all of one revision of the map."""

    verdicts: npt.NDArray[np.uint8]
    """(n,): CollisionVerdict."""
    revision: int
    """Revision of the map."""
    contacts: VoxelContacts | None = None
    """If asked for."""
    self_colliding: npt.NDArray[np.bool_] | None = None
    """(n,): whether two links touch that must not, if asked for. Verdicts are about the map alone."""
    clearance: Clearance | None = None
    """If asked for."""


class CollisionChecker:
    """Tells whether a robot collides with one revision of a map. Immutable; usable from any thread.

    unknown: "free" ignores space that was never observed; with "occupied" a pose that meets it, and nothing occupied,
    is UNKNOWN. What lies beyond the octree is unknown.
    padding_m: added to the padding of every link, or of the named ones. A padded link collides with the voxels that it
    would touch if they were grown by its padding on all sides, which is all that come within the padding, and some at
    corners beyond it.
    occupancy_threshold: probability from which on a voxel is occupied; None is the map's own.
    accuracy_m: None takes the robot's meshes as they are. A bound lets links be simpler than that, padded by what they
    miss: still no collision is missed, but a pose may count as colliding that comes within accuracy_m of a voxel along
    each axis of the map. The simpler meshes are made when they are first asked for, and stay with the robot.

    A link collides with a voxel, a closed cube, that touches its surface, or lies inside of a closed part of it. Open
    meshes are surfaces (Robot.links[i].is_closed). No collision is missed, and voxels further away than rounding, some
    1e-14 of the lengths involved, are not touched (DESIGN section 2).

    Raises InvalidInputError for another policy, a padding that is not a finite number of at least 0, a threshold
    outside (0, 1), an accuracy that is not a finite number above zero.
    """

    def __init__(
        self,
        map_snapshot: MapSnapshot,
        robot: Robot,
        unknown: UnknownPolicy = "free",
        padding_m: float | Mapping[str, float] = 0.0,
        occupancy_threshold: float | None = None,
        accuracy_m: float | None = None,
    ) -> None:
        if unknown not in get_args(UnknownPolicy):
            raise InvalidInputError(f"unknown must be one of {', '.join(get_args(UnknownPolicy))}, got {unknown!r}")
        self.map_snapshot = map_snapshot
        self.robot = robot
        self._unknown_is_occupied = unknown == "occupied"
        model = (
            map_snapshot.sensor_model if occupancy_threshold is None else SensorModel(p_occupied=occupancy_threshold)
        )
        self._occupied_log_odds = model.native.occupied_log_odds
        bodies = [link.body_within(accuracy_m) for link in robot.links]
        self._bodies = [body.native for body in bodies]
        self._paddings_m = [
            padding + body.error_m for padding, body in zip(robot.paddings_m(padding_m), bodies, strict=True)
        ]

    def check(
        self,
        configurations: npt.ArrayLike | None = None,
        T_map_base: npt.ArrayLike | None = None,
        *,
        contacts: Literal["none", "first", "all"] = "none",
        self_collision: bool = False,
        cancellation: CancellationToken | None = None,
        max_clearance_m: float | None = None,
    ) -> CollisionCheck:
        """Verdicts of n configurations and base poses, on all threads, without the GIL.

        configurations: (n, j) or (j,), radians and metres in the order of Robot.joint_names; None for a robot without
        joints. T_map_base: (n, 4, 4) or (4, 4) rigid, float64; None is the identity. One of either goes with any
        number of the other. contacts: "first" is one voxel per pose, an occupied one where there is one; "all" every
        one; a pose may be UNKNOWN for what lies beyond the octree, where there are no voxels.
        self_collision: also test the pairs of links that the allowed-collision matrix does not allow, without padding.
        cancellation: cancelled from another thread, it ends the query.
        max_clearance_m: also measure what clearance() does, up to this.

        Raises InvalidInputError for wrong shapes, values that are not finite, and poses that are not rigid;
        QueryCancelledError.
        """
        T_map_links = self.robot.link_poses(configurations, T_map_base)
        clearance = None if max_clearance_m is None else self._measure(T_map_links, max_clearance_m, cancellation)
        voxels = None
        if clearance is not None and contacts == "none":
            verdicts = clearance.verdicts  # measuring begins with them
        else:
            verdicts, rows, log_odds = self._ask(T_map_links, contacts, None, cancellation)
            voxels = None if contacts == "none" else self._voxels(rows, log_odds)
        colliding = self_collisions(self.robot, T_map_links, cancellation) if self_collision else None
        return CollisionCheck(verdicts, self.map_snapshot.revision, voxels, colliding, clearance)

    def clearance(
        self,
        configurations: npt.ArrayLike | None = None,
        T_map_base: npt.ArrayLike | None = None,
        *,
        max_clearance_m: float = np.inf,
    ) -> Clearance:
        """How far the robot is from the nearest voxel that counts, n configurations and base poses, on all threads.

        configurations, T_map_base: as for check. max_clearance_m: nothing is looked for beyond it, and such a pose gets
        it (1e15 at most) as a lower bound. Voxels that count are the occupied ones and, with unknown="occupied",
        unknown space and what lies beyond the octree. A pose that collides, with a voxel inside of a closed link too,
        has 0.

        The distance is exact, that of one triangle and one voxel in float64, and rounded down by some 1e-14 of the
        lengths involved (for less than a millionth of those lengths by more, relatively). Of a padded link it is the
        distance from voxels grown by the padding on all sides, as for check: at most the distance of the link's surface
        less the padding, and less where a corner of a voxel is nearest, so that 0 means what check says.
        Raises InvalidInputError as check, and unless max_clearance_m is above zero.
        """
        return self._measure(self.robot.link_poses(configurations, T_map_base), max_clearance_m, None)

    def check_motion(
        self,
        q_from: npt.ArrayLike | None,
        q_to: npt.ArrayLike | None,
        T_map_base: npt.ArrayLike | None = None,
        T_map_base_to: npt.ArrayLike | None = None,
        *,
        tolerance_m: float = 0.005,
        cancellation: CancellationToken | None = None,
    ) -> MotionCheck:
        """Whether n motions, on which all joints and the base move at constant speed, collide anywhere.

        q_from, q_to: (n, j) or (j,), radians and metres; None for a robot without joints. T_map_base, T_map_base_to:
        (n, 4, 4) or (4, 4) rigid; None is the identity, and as T_map_base_to a base that rests. The base's origin moves
        on a straight line, while it turns about one axis by the smaller angle. One of each goes with any number of the
        others. tolerance_m: the least distance that is told from a collision. A motion is free only if no collision can
        lie between samples (motion_check.py); one that passes an obstacle closer than the tolerance may be reported as
        colliding. Links are not tested against each other.

        Raises as check, and InvalidInputError for a tolerance that is not a finite number above zero.
        """
        motions = Motions.between(self.robot, (q_from, q_to), (T_map_base, T_map_base_to))
        return self._check_motions(motions, tolerance_m, cancellation)

    def check_path(
        self,
        configurations: npt.ArrayLike | None,
        T_map_base: npt.ArrayLike | None = None,
        *,
        tolerance_m: float = 0.005,
    ) -> PathCheck:
        """Where a path through m configurations or base poses first collides; from one to the next as check_motion.

        configurations: (m, j), or (j,) if only the base moves; T_map_base: (m, 4, 4), or (4, 4) for a base that rests.
        Raises InvalidInputError, also for a path of a single waypoint.
        """
        whole = Motions.between(self.robot, (configurations, configurations), (T_map_base, T_map_base))
        if len(whole.q_from) < 2:
            raise InvalidInputError("a path needs at least two waypoints")
        q, T = whole.q_from, whole.T_map_base_from
        return first_of_path(self._check_motions(Motions(q[:-1], q[1:], T[:-1], T[1:]), tolerance_m, None))

    def _check_motions(
        self, motions: Motions, tolerance_m: float, cancellation: CancellationToken | None
    ) -> MotionCheck:
        def check(T_map_links: npt.NDArray[np.float64], more_m: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
            return self._ask(T_map_links, "none", more_m, cancellation)[0]

        return check_motions(self.robot, motions, tolerance_m, check)

    def _ask(
        self,
        T_map_links: npt.NDArray[np.float64],
        contacts: str,
        more_padding_m: npt.NDArray[np.float64] | None,
        cancellation: CancellationToken | None,
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.int64], npt.NDArray[np.float32]]:
        return _native.check_poses(
            self.map_snapshot._revision_asked(),
            self._bodies,
            self._paddings_m,
            T_map_links,
            self._unknown_is_occupied,
            self._occupied_log_odds,
            contacts,
            more_padding_m,
            cancellation,
        )

    def _measure(
        self, T_map_links: npt.NDArray[np.float64], max_clearance_m: float, cancellation: CancellationToken | None
    ) -> Clearance:
        rows = _native.measure_clearances(
            self.map_snapshot._revision_asked(),
            self._bodies,
            self._paddings_m,
            T_map_links,
            self._unknown_is_occupied,
            self._occupied_log_odds,
            max_clearance_m,
            cancellation,
        )
        return clearance_of(*rows, self.map_snapshot.resolution_m, self.map_snapshot.revision)

    def _voxels(self, rows: npt.NDArray[np.int64], log_odds: npt.NDArray[np.float32]) -> VoxelContacts:
        cells_wide = np.ldexp(1.0, rows[:, 5]).astype(np.float64)
        resolution_m = self.map_snapshot.resolution_m
        return VoxelContacts(
            pose=rows[:, 0],
            link=rows[:, 1],
            centre_m=(rows[:, 2:5] + 0.5 * cells_wide[:, None]) * resolution_m,
            size_m=cells_wide * resolution_m,
            log_odds=log_odds,
        )
