"""Collisions of a robot with a map: from JSON or a frame, to an answer in the same form."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from rayvox import CollisionCheck, CollisionChecker, MapSnapshot, Robot, VoxelContacts

from rayvox_service.frame import AnyArray, Frame, FrameTooLargeError, encode_frame
from rayvox_service.problems import Problem

KIND = "collisions"
ANSWER = "verdicts"
PAYLOAD_DIMENSIONS = {"configurations": 2, "T_map_base": 3}
# All contacts of a pose can be as many as there are voxels around the robot.
MOST_POSES_WITH_ALL_CONTACTS = 100


class CollisionQuery(BaseModel):
    """What stands beside the poses: JSON fields, or a frame's header."""

    model_config = ConfigDict(extra="forbid")

    robot: str
    unknown: Literal["free", "occupied"] = "free"
    padding_m: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)
    occupancy_threshold: float | None = Field(default=None, gt=0.0, lt=1.0)
    accuracy_m: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    self_collision: bool = False
    contacts: Literal["none", "first", "all"] = "none"


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

    def require_at_most(self, most: int) -> None:
        count = max((len(array) for array in (self.configurations, self.T_map_base) if array is not None), default=1)
        if count > most:
            raise Problem("too-large", f"{count} poses, the limit is {most}")


def poses_of_frame(frame: Frame, most: int) -> Poses:
    """The frame's poses, after their counts were checked. Raises FrameError, Problem."""
    if frame.kind != KIND or not set(frame.payloads) <= set(PAYLOAD_DIMENSIONS):
        raise Problem("invalid-input", f"a {KIND} frame with {' and '.join(PAYLOAD_DIMENSIONS)} is needed here")
    arrays: dict[str, AnyArray] = {}
    for name, payload in frame.payloads.items():
        if payload.dtype.str not in ("<f4", "<f8") or len(payload.shape) != PAYLOAD_DIMENSIONS[name]:
            raise Problem("invalid-input", f"{name} must have {PAYLOAD_DIMENSIONS[name]} dimensions of <f4 or <f8")
        if payload.shape[0] > most:
            raise FrameTooLargeError(f"{name} has {payload.shape[0]} rows, the limit is {most}")
        arrays[name] = frame.array(name)
    return Poses(arrays.get("configurations"), arrays.get("T_map_base"))


def check_collisions(query: CollisionQuery, poses: Poses, robot: Robot, snapshot: MapSnapshot) -> CollisionCheck:
    """Raises rayvox.InvalidInputError, Problem."""
    if query.contacts == "all":
        poses.require_at_most(MOST_POSES_WITH_ALL_CONTACTS)
    checker = CollisionChecker(
        snapshot, robot, query.unknown, query.padding_m, query.occupancy_threshold, query.accuracy_m
    )
    return checker.check(
        poses.configurations, poses.T_map_base, contacts=query.contacts, self_collision=query.self_collision
    )


def check_as_frame(check: CollisionCheck) -> bytes:
    arrays: dict[str, AnyArray] = {"verdicts": check.verdicts}
    if check.self_colliding is not None:
        arrays["self_colliding"] = check.self_colliding.astype(np.uint8)
    if check.contacts is not None:
        arrays |= {f"contact_{name}": array for name, array in _columns(check.contacts).items()}
    return encode_frame(ANSWER, {"revision": check.revision}, arrays)


def check_as_json(check: CollisionCheck) -> bytes:
    document: dict[str, Any] = {"revision": check.revision, "verdicts": check.verdicts.tolist()}
    if check.self_colliding is not None:
        document["self_colliding"] = check.self_colliding.tolist()
    if check.contacts is not None:
        columns = {name: array.tolist() for name, array in _columns(check.contacts).items()}
        # JSON knows no NaN: null says that the voxel is unknown.
        columns["log_odds"] = [value if math.isfinite(value) else None for value in columns["log_odds"]]
        rows = zip(*columns.values(), strict=True)
        document["contacts"] = [dict(zip(columns, row, strict=True)) for row in rows]
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode()


def _columns(contacts: VoxelContacts) -> dict[str, AnyArray]:
    return {
        "pose": contacts.pose.astype(np.int32),
        "link": contacts.link.astype(np.int32),
        "centre_m": contacts.centre_m,
        "size_m": contacts.size_m,
        "log_odds": contacts.log_odds,
    }
