"""Collisions of a robot with a map: from JSON or a frame, to an answer in the same form."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from pydantic import Field
from rayvox import CancellationToken, Clearance, CollisionCheck, MapSnapshot, Robot, VoxelContacts
from rayvox.errors import InvalidInputError

from rayvox_service.frame import AnyArray, Frame, encode_frame
from rayvox_service.problems import Problem
from rayvox_service.robot_query import RobotQuery, arrays_of_frame
from rayvox_service.steps import Steps, in_batches, joined

KIND = "collisions"
ANSWER = "verdicts"
PAYLOAD_DIMENSIONS = {"configurations": 2, "T_map_base": 3}
# All contacts of a pose can be as many as there are voxels around the robot.
MOST_POSES_WITH_ALL_CONTACTS = 100
FIRST_POSES = 64


class CollisionQuery(RobotQuery):
    """What stands beside the poses: JSON fields, or a frame's header."""

    self_collision: bool = False
    contacts: Literal["none", "first", "all"] = "none"
    clearance_m: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)


class JsonCollisionQuery(CollisionQuery):
    configurations: list[list[float]] | None = None
    T_map_base: list[list[float]] | None = Field(default=None, description="16 numbers each, row-major")

    def poses(self) -> Poses:
        """Raises Problem invalid-input."""
        if len({len(row) for row in self.configurations or ()}) > 1:
            raise Problem("invalid-input", "configurations need as many values each")
        if any(len(row) != 16 for row in self.T_map_base or ()):
            raise Problem("invalid-input", "T_map_base needs 16 numbers for each pose")
        configurations = None if self.configurations is None else np.array(self.configurations, np.float64)
        bases = None if self.T_map_base is None else np.array(self.T_map_base, np.float64).reshape(-1, 4, 4)
        return Poses(configurations, bases)


@dataclass(frozen=True, slots=True)
class Poses:
    """(n, j) configurations and (n, 4, 4) base poses; None as in CollisionChecker.check."""

    configurations: AnyArray | None
    T_map_base: AnyArray | None

    @property
    def count(self) -> int:
        lengths = {len(array) for array in (self.configurations, self.T_map_base) if array is not None}
        return max(lengths - {1}, default=1)

    def require_at_most(self, most: int) -> None:
        if self.count > most:
            raise Problem("too-large", f"{self.count} poses, the limit is {most}")

    def require_matching(self) -> None:
        arrays = [array for array in (self.configurations, self.T_map_base) if array is not None]
        if any(len(array) not in (1, self.count) for array in arrays):
            counts = " configurations do not go with ".join(str(len(array)) for array in arrays)
            raise Problem("invalid-input", f"{counts} base poses")

    def rows(self, part: slice) -> Poses:
        """Some of the poses; a single row goes with all."""
        first, second = (
            array if array is None or len(array) == 1 else array[part]
            for array in (self.configurations, self.T_map_base)
        )
        return Poses(first, second)


def poses_of_frame(frame: Frame, most: int) -> Poses:
    """The frame's poses, after their counts were checked. Raises FrameError, Problem."""
    if frame.kind != KIND:
        raise Problem("invalid-input", f"a {KIND} frame with {' and '.join(PAYLOAD_DIMENSIONS)} is needed here")
    arrays = arrays_of_frame(frame, PAYLOAD_DIMENSIONS, most)
    return Poses(arrays.get("configurations"), arrays.get("T_map_base"))


def check_collisions(
    query: CollisionQuery, poses: Poses, robot: Robot, snapshot: MapSnapshot, cancellation: CancellationToken
) -> Steps[CollisionCheck]:
    """All of it on the one snapshot. Raises rayvox.InvalidInputError, QueryCancelledError, Problem."""
    if query.contacts == "all":
        poses.require_at_most(MOST_POSES_WITH_ALL_CONTACTS)
    poses.require_matching()
    checker = query.checker(snapshot, robot)

    def batch(part: slice) -> CollisionCheck:
        asked = poses.rows(part)
        try:
            check = checker.check(
                asked.configurations, asked.T_map_base, contacts=query.contacts, self_collision=query.self_collision,
                max_clearance_m=query.clearance_m, cancellation=cancellation,
            )  # fmt: skip
        except InvalidInputError:
            # Raises the same, but names the row as the sender counts them.
            robot.link_poses(poses.configurations, poses.T_map_base)
            raise
        if check.contacts is None:
            return check
        return replace(check, contacts=replace(check.contacts, pose=check.contacts.pose + part.start))

    checks = yield from in_batches(poses.count, batch, FIRST_POSES)
    contacts = [check.contacts for check in checks if check.contacts is not None]
    clearances = [check.clearance for check in checks if check.clearance is not None]
    return replace(
        joined(checks),
        contacts=joined(contacts) if contacts else None,
        clearance=joined(clearances) if clearances else None,
    )


def check_as_frame(check: CollisionCheck) -> bytes:
    arrays: dict[str, AnyArray] = {"verdicts": check.verdicts}
    if check.self_colliding is not None:
        arrays["self_colliding"] = check.self_colliding.astype(np.uint8)
    if check.contacts is not None:
        arrays |= {f"contact_{name}": array for name, array in _columns(check.contacts).items()}
    if check.clearance is not None:
        arrays["clearance_m"] = check.clearance.clearance_m
        arrays |= {f"clearance_{name}": array for name, array in _witness_columns(check.clearance).items()}
        arrays["clearance_is_lower_bound"] = check.clearance.is_lower_bound.astype(np.uint8)
    return encode_frame(ANSWER, {"revision": check.revision}, arrays)


def check_as_json(check: CollisionCheck) -> bytes:
    document: dict[str, Any] = {"revision": check.revision, "verdicts": check.verdicts.tolist()}
    if check.self_colliding is not None:
        document["self_colliding"] = check.self_colliding.tolist()
    if check.contacts is not None:
        document["contacts"] = _records(_columns(check.contacts))
    if check.clearance is not None:
        columns = {"clearance_m": check.clearance.clearance_m, **_witness_columns(check.clearance)}
        document["clearances"] = _records(columns)
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode()


def _records(columns: dict[str, AnyArray]) -> list[dict[str, Any]]:
    """Row by row. JSON knows no NaN: null stands for a value that has one."""
    lists = [[_without_nan(value) for value in column.tolist()] for column in columns.values()]
    return [dict(zip(columns, row, strict=True)) for row in zip(*lists, strict=True)]


def _without_nan(value: Any) -> Any:
    first = value[0] if isinstance(value, list) else value
    return None if isinstance(first, float) and math.isnan(first) else value


def _witness_columns(clearance: Clearance) -> dict[str, AnyArray]:
    return {
        "is_lower_bound": clearance.is_lower_bound,
        "direction": clearance.direction,
        "link": clearance.link.astype(np.int32),
        "point_m": clearance.point_m,
        "voxel_centre_m": clearance.voxel_centre_m,
        "voxel_size_m": clearance.voxel_size_m,
    }


def _columns(contacts: VoxelContacts) -> dict[str, AnyArray]:
    return {
        "pose": contacts.pose.astype(np.int32),
        "link": contacts.link.astype(np.int32),
        "centre_m": contacts.centre_m,
        "size_m": contacts.size_m,
        "log_odds": contacts.log_odds,
    }
