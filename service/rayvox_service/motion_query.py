"""Motions of a robot through a map: from JSON or a frame, to an answer in the same form."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from pydantic import Field
from rayvox import CancellationToken, MapSnapshot, MotionCheck, Robot
from rayvox.errors import InvalidInputError

from rayvox_service.frame import AnyArray, Frame, FrameTooLargeError, encode_frame
from rayvox_service.problems import Problem
from rayvox_service.robot_query import RobotQuery
from rayvox_service.steps import Steps, in_batches, joined

KIND = "motions"
ANSWER = "motion_verdicts"
FIRST_MOTIONS = 4
PAYLOAD_DIMENSIONS = {"q_from": 2, "q_to": 2, "T_map_base": 3}


class MotionQuery(RobotQuery):
    """What stands beside the motions: JSON fields, or a frame's header."""

    tolerance_m: float = Field(default=0.005, ge=1e-4, allow_inf_nan=False)


class JsonMotionQuery(MotionQuery):
    q_from: list[list[float]]
    q_to: list[list[float]]
    T_map_base: list[float] | None = Field(default=None, min_length=16, max_length=16)

    def motions(self) -> Motions:
        """Raises Problem invalid-input."""
        if len({len(row) for row in (*self.q_from, *self.q_to)}) > 1:
            raise Problem("invalid-input", "configurations need as many values each")
        base = None if self.T_map_base is None else np.array(self.T_map_base).reshape(4, 4)
        return Motions(np.array(self.q_from, np.float64), np.array(self.q_to, np.float64), base)


@dataclass(frozen=True, slots=True)
class Motions:
    """(n, j) or (1, j) configurations to start and to end at, and the (4, 4) pose at which the base rests."""

    q_from: AnyArray
    q_to: AnyArray
    T_map_base: AnyArray | None

    def __post_init__(self) -> None:
        if any(len(q) not in (1, self.count) for q in (self.q_from, self.q_to)):
            raise Problem("invalid-input", f"{len(self.q_from)} configurations do not go with {len(self.q_to)}")

    @property
    def count(self) -> int:
        return max({len(self.q_from), len(self.q_to)} - {1}, default=1)

    def require_at_most(self, most: int) -> None:
        if self.count > most:
            raise Problem("too-large", f"{self.count} motions, the limit is {most}")

    def rows(self, part: slice) -> Motions:
        first, second = (q if len(q) == 1 else q[part] for q in (self.q_from, self.q_to))
        return Motions(first, second, self.T_map_base)


def motions_of_frame(frame: Frame, most: int) -> Motions:
    """The frame's motions, after their counts were checked. Raises FrameError, Problem."""
    if frame.kind != KIND or not {"q_from", "q_to"} <= set(frame.payloads) <= set(PAYLOAD_DIMENSIONS):
        raise Problem("invalid-input", f"a {KIND} frame with q_from, q_to and perhaps T_map_base is needed here")
    arrays: dict[str, AnyArray] = {}
    for name, payload in frame.payloads.items():
        if payload.dtype.str not in ("<f4", "<f8") or len(payload.shape) != PAYLOAD_DIMENSIONS[name]:
            raise Problem("invalid-input", f"{name} must have {PAYLOAD_DIMENSIONS[name]} dimensions of <f4 or <f8")
        if payload.shape[0] > most:
            raise FrameTooLargeError(f"{name} has {payload.shape[0]} rows, the limit is {most}")
        arrays[name] = frame.array(name)
    base = arrays.get("T_map_base")
    if base is not None and base.shape != (1, 4, 4):
        raise Problem("invalid-input", f"T_map_base has shape {list(base.shape)}: the base rests at one pose")
    return Motions(arrays["q_from"], arrays["q_to"], None if base is None else base[0])


def check_motions(
    query: MotionQuery, motions: Motions, robot: Robot, snapshot: MapSnapshot, cancellation: CancellationToken
) -> Steps[MotionCheck]:
    """All of it on the one snapshot. Raises rayvox.InvalidInputError, QueryCancelledError."""
    checker = query.checker(snapshot, robot)

    def batch(part: slice) -> MotionCheck:
        asked = motions.rows(part)
        try:
            return checker.check_motion(
                asked.q_from, asked.q_to, asked.T_map_base, tolerance_m=query.tolerance_m, cancellation=cancellation
            )
        except InvalidInputError:
            # Raises the same, but names the row as the sender counts them.
            robot.motion_bounds(motions.q_from, motions.q_to, motions.T_map_base)
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
