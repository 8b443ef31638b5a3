"""A robot as it is for some queries: with what it holds, and with other pairs of links that may touch."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from rayvox import Robot, TriangleMesh
from rayvox.robot.primitives import box_mesh, cylinder_mesh, sphere_mesh

LengthM = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class AttachedObject(BaseModel):
    """A box (edges), cylinder (radius, length along z) or sphere (radius) about the object's own origin, metres."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(default="attached", min_length=1, max_length=200)
    link: str
    T_link_object: tuple[Number, ...] | None = Field(default=None, min_length=16, max_length=16)
    box: tuple[LengthM, LengthM, LengthM] | None = None
    cylinder: tuple[LengthM, LengthM] | None = None
    sphere: LengthM | None = None
    padding_m: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)
    touch_links: tuple[str, ...] = Field(default=(), max_length=1000)

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if [self.box, self.cylinder, self.sphere].count(None) != 2:
            raise ValueError("an attached object is one of box, cylinder and sphere")
        return self

    def mesh(self) -> TriangleMesh:
        """Contains the shape; reaches beyond it as a URDF's shapes do."""
        if self.box is not None:
            return box_mesh(self.box)
        if self.cylinder is not None:
            return cylinder_mesh(*self.cylinder)[0]
        assert self.sphere is not None
        return sphere_mesh(self.sphere)[0]

    def attach_to(self, robot: Robot) -> Robot:
        pose = None if self.T_link_object is None else np.array(self.T_link_object).reshape(4, 4)
        return robot.with_attached(self.name, self.mesh(), self.link, pose, self.touch_links, self.padding_m)


class RobotVariant(BaseModel):
    """Hashable: equal variants of a robot are built once."""

    model_config = ConfigDict(frozen=True)

    attached: tuple[AttachedObject, ...] = ()
    allow: tuple[tuple[str, str], ...] = ()
    forbid: tuple[tuple[str, str], ...] = ()

    def of(self, robot: Robot) -> Robot:
        """Raises rayvox.InvalidInputError for a name that is no link, or taken, and a pose that is not rigid."""
        for thing in self.attached:
            robot = thing.attach_to(robot)
        if not (self.allow or self.forbid):
            return robot
        return robot.with_allowed_collisions(
            robot.allowed_collisions.with_allowed(self.allow).with_forbidden(self.forbid)
        )
