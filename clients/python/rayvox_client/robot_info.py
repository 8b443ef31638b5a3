"""What the service says about a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rayvox_client.errors import MalformedAnswerError
from rayvox_client.fields import Fields


@dataclass(frozen=True)
class RobotLink:
    """One rigid body. closed: whether its geometry has an inside; an open one is treated as a surface."""

    name: str
    triangles: int
    closed: bool


@dataclass(frozen=True)
class RobotInfo:
    """One robot.

    Attributes:
        name: under which it is asked about.
        state: "ready", or "failed" for one that the service could not restore.
        joint_names: column i of a configuration is the value of joint_names[i], radians or metres.
        lower, upper: limits of the joints, infinite for continuous ones; empty in lists.
        links: empty in lists.
        triangles: of all links.
        nbytes, sha256: of the upload.
    """

    name: str
    state: str
    joint_names: tuple[str, ...] = ()
    lower: tuple[float, ...] = ()
    upper: tuple[float, ...] = ()
    links: tuple[RobotLink, ...] = ()
    triangles: int = 0
    nbytes: int = 0
    sha256: str = ""

    @classmethod
    def from_fields(cls, fields: Fields) -> RobotInfo:
        """Read the API's robot object, or its summary in a list."""
        if fields.text("state") != "ready":
            return cls(fields.text("name"), fields.text("state"))
        listed = isinstance(fields.values.get("links"), int)
        return cls(
            name=fields.text("name"),
            state=fields.text("state"),
            joint_names=_texts(fields, "joints"),
            lower=() if listed else _limits(fields.values, "lower", -math.inf),
            upper=() if listed else _limits(fields.values, "upper", math.inf),
            links=() if listed else tuple(_link(link) for link in fields.list_of("links")),
            triangles=fields.integer("triangles"),
            nbytes=fields.integer("nbytes"),
            sha256=fields.text("sha256"),
        )


def _link(fields: Fields) -> RobotLink:
    return RobotLink(fields.text("name"), fields.integer("triangles"), fields.boolean("closed"))


def _texts(fields: Fields, name: str) -> tuple[str, ...]:
    values = fields.values.get(name)
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise MalformedAnswerError(f"{fields.where}: {name} is not a list of strings")
    return tuple(values)


def _limits(values: Mapping[str, object], name: str, unlimited: float) -> tuple[float, ...]:
    limits = values.get(name)
    if not isinstance(limits, list) or not all(limit is None or isinstance(limit, int | float) for limit in limits):
        raise MalformedAnswerError(f"answer: {name} is not a list of numbers")
    return tuple(unlimited if limit is None else float(limit) for limit in limits)
