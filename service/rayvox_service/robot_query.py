"""What collision and motion queries say of the robot they are about."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field
from rayvox import CollisionChecker, MapSnapshot, Robot

from rayvox_service.frame import AnyArray, Frame, FrameTooLargeError
from rayvox_service.problems import Problem
from rayvox_service.robot_variant import MOST_ATTACHED, AttachedObject, RobotVariant
from rayvox_service.stored_robot import StoredRobot

PaddingM = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
LinkPair = tuple[str, str]
UnknownPolicy = Literal["free", "occupied"]


class RobotQuery(BaseModel):
    """JSON fields, or a frame's header."""

    model_config = ConfigDict(extra="forbid")

    robot: str
    attached: tuple[AttachedObject, ...] = Field(default=(), max_length=MOST_ATTACHED)
    allow: tuple[LinkPair, ...] = Field(default=(), max_length=10_000, description="pairs of links that may touch")
    forbid: tuple[LinkPair, ...] = Field(default=(), max_length=10_000, description="pairs that may not after all")
    unknown: UnknownPolicy | None = Field(default=None, description="the service's setting where it is not said")
    padding_m: PaddingM | dict[str, PaddingM] = 0.0
    occupancy_threshold: float | None = Field(default=None, gt=0.0, lt=1.0)
    accuracy_m: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)

    def with_default(self, unknown: UnknownPolicy) -> Self:
        """The query with this policy for unknown space, unless it has one of its own."""
        return self if self.unknown is not None else self.model_copy(update={"unknown": unknown})

    def variant_of(self, stored: StoredRobot) -> Robot:
        """The uploaded robot with what it carries now. Raises rayvox.InvalidInputError."""
        return stored.variant(RobotVariant(attached=self.attached, allow=self.allow, forbid=self.forbid))

    def checker(self, snapshot: MapSnapshot, robot: Robot) -> CollisionChecker:
        """Raises rayvox.InvalidInputError."""
        unknown = self.unknown or "free"
        return CollisionChecker(snapshot, robot, unknown, self.padding_m, self.occupancy_threshold, self.accuracy_m)


def arrays_of_frame(frame: Frame, dimensions: Mapping[str, int], most: int) -> dict[str, AnyArray]:
    """The frame's payloads of so many dimensions by name, after their rows were counted. Raises FrameError, Problem."""
    if not set(frame.payloads) <= set(dimensions):
        raise Problem("invalid-input", f"a {frame.kind} frame with {', '.join(dimensions)} is needed here")
    arrays: dict[str, AnyArray] = {}
    for name, payload in frame.payloads.items():
        if payload.dtype.str not in ("<f4", "<f8") or len(payload.shape) != dimensions[name]:
            raise Problem("invalid-input", f"{name} must have {dimensions[name]} dimensions of <f4 or <f8")
        if payload.shape[0] > most:
            raise FrameTooLargeError(f"{name} has {payload.shape[0]} rows, the limit is {most}")
        arrays[name] = frame.array(name)
    return arrays
