"""Motions of a robot through a map: from JSON or a frame, to an answer in the same form."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from pydantic import Field
from rayvox import CancellationToken, MapSnapshot, MotionCheck, Robot
from rayvox.errors import InvalidInputError

from rayvox_service.frame import AnyArray, Frame, encode_frame
from rayvox_service.problems import Problem
from rayvox_service.robot_query import RobotQuery, arrays_of_frame
from rayvox_service.steps import Steps, in_batches, joined

KIND = "motions"
ANSWER = "motion_verdicts"
FIRST_MOTIONS = 4
PAYLOAD_DIMENSIONS = {"q_from": 2, "q_to": 2, "T_map_base": 3, "T_map_base_to": 3}


class MotionQuery(RobotQuery):
    """What stands beside the motions: JSON fields, or a frame's header."""

    tolerance_m: float = Field(default=0.005, ge=1e-4, allow_inf_nan=False)


class JsonMotionQuery(MotionQuery):
    q_from: list[list[float]] | None = None
    q_to: list[list[float]] | None = None
    T_map_base: list[list[float]] | None = Field(default=None, description="16 numbers each, row-major")
    T_map_base_to: list[list[float]] | None = Field(default=None, description="as T_map_base, which is where it rests")

    def motions(self) -> Motions:
        """Raises Problem invalid-input."""
        if len({len(row) for row in (*(self.q_from or ()), *(self.q_to or ()))}) > 1:
            raise Problem("invalid-input", "configurations need as many values each")
        if any(len(row) != 16 for row in (*(self.T_map_base or ()), *(self.T_map_base_to or ()))):
            raise Problem("invalid-input", "T_map_base and T_map_base_to need 16 numbers for each pose")
        ends = [None if rows is None else np.array(rows, np.float64) for rows in (self.q_from, self.q_to)]
        poses = [
            None if rows is None else np.array(rows, np.float64).reshape(-1, 4, 4)
            for rows in (self.T_map_base, self.T_map_base_to)
        ]
        return Motions(*ends, *poses)


@dataclass(frozen=True, slots=True)
class Motions:
    """(n, j) configurations and (n, 4, 4) base poses to start and to end at; None as in CollisionChecker.check_motion,
    a single row goes with all."""

    q_from: AnyArray | None
    q_to: AnyArray | None
    T_map_base: AnyArray | None
    T_map_base_to: AnyArray | None

    def __post_init__(self) -> None:
        counts = {name: len(array) for name in PAYLOAD_DIMENSIONS if (array := getattr(self, name)) is not None}
        if len(set(counts.values()) - {1}) > 1:
            raise Problem("invalid-input", f"as many rows of each, or one, make motions, not {counts}")

    @property
    def count(self) -> int:
        arrays = (self.q_from, self.q_to, self.T_map_base, self.T_map_base_to)
        return max({len(array) for array in arrays if array is not None} - {1}, default=1)

    def require_at_most(self, most: int) -> None:
        if self.count > most:
            raise Problem("too-large", f"{self.count} motions, the limit is {most}")

    def rows(self, part: slice) -> Motions:
        arrays = (self.q_from, self.q_to, self.T_map_base, self.T_map_base_to)
        return Motions(*(array if array is None or len(array) == 1 else array[part] for array in arrays))


def motions_of_frame(frame: Frame, most: int) -> Motions:
    """The frame's motions, after their counts were checked. Raises FrameError, Problem."""
    if frame.kind != KIND:
        raise Problem("invalid-input", f"a {KIND} frame with {', '.join(PAYLOAD_DIMENSIONS)} is needed here")
    arrays = arrays_of_frame(frame, PAYLOAD_DIMENSIONS, most)
    return Motions(*(arrays.get(name) for name in PAYLOAD_DIMENSIONS))


def check_motions(
    query: MotionQuery, motions: Motions, robot: Robot, snapshot: MapSnapshot, cancellation: CancellationToken
) -> Steps[MotionCheck]:
    """All of it on the one snapshot. Raises rayvox.InvalidInputError, QueryCancelledError."""
    checker = query.checker(snapshot, robot)

    def batch(part: slice) -> MotionCheck:
        asked = motions.rows(part)
        try:
            return checker.check_motion(
                asked.q_from, asked.q_to, asked.T_map_base, asked.T_map_base_to,
                tolerance_m=query.tolerance_m, cancellation=cancellation,
            )  # fmt: skip
        except InvalidInputError:
            # Raises the same, but names the row as the sender counts them.
            robot.motion_bounds(motions.q_from, motions.q_to, motions.T_map_base, motions.T_map_base_to)
            raise

    return joined((yield from in_batches(motions.count, batch, FIRST_MOTIONS)))


def check_as_frame(check: MotionCheck, revision: int) -> bytes:
    arrays: dict[str, AnyArray] = {"verdicts": check.verdicts, "free_until": check.free_until}
    return encode_frame(ANSWER, {"revision": revision, "tolerance_m": check.tolerance_m}, arrays)


def check_as_json(check: MotionCheck, revision: int) -> bytes:
    document = {
        "revision": revision,
        "tolerance_m": check.tolerance_m,
        "verdicts": check.verdicts.tolist(),
        "free_until": check.free_until.tolist(),
    }
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
