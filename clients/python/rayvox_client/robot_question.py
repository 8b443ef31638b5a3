"""Questions about a robot in a map: whether it collides at poses, or on motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Literal, TypedDict

from numpy.typing import ArrayLike, NDArray

from rayvox_client import validation
from rayvox_client.attached_object import AttachedObject
from rayvox_client.clearance import Clearance
from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.errors import InvalidInputError
from rayvox_client.question import Question
from rayvox_client.robot_info import RobotInfo

UnknownPolicy = Literal["free", "occupied"]
ContactMode = Literal["none", "first", "all"]
LinkPairs = Sequence[tuple[str, str]]


class RobotOptions(TypedDict, total=False):
    """Keyword arguments of every question about a robot; `Client.check` says what they mean."""

    unknown: UnknownPolicy
    padding_m: float | Mapping[str, float]
    occupancy_threshold: float | None
    accuracy_m: float | None
    attached: Sequence[AttachedObject]
    allow: LinkPairs
    forbid: LinkPairs
    min_revision: int | None


class CheckOptions(RobotOptions, total=False):
    """Keyword arguments of `Client.check`."""

    self_collision: bool
    contacts: ContactMode


class MotionOptions(RobotOptions, total=False):
    """Keyword arguments of `Client.check_motion`."""

    T_map_base_to: ArrayLike
    tolerance_m: float


def check_question(
    robot: str | RobotInfo,
    configurations: ArrayLike | None,
    T_map_base: ArrayLike | None,
    options: CheckOptions,
) -> Question[CollisionCheck]:
    """As `Client.check`. Raises InvalidInputError for arguments that can be seen to be wrong."""
    payloads, count = _poses(configurations, T_map_base)
    read = partial(CollisionCheck.from_frame, count=count)
    return Question("collisions", _header(robot, options), payloads, read, options.get("min_revision"))


def clearance_question(
    robot: str | RobotInfo,
    configurations: ArrayLike | None,
    T_map_base: ArrayLike | None,
    max_clearance_m: float,
    options: RobotOptions,
) -> Question[Clearance]:
    """As `Client.clearance`. Raises InvalidInputError for arguments that can be seen to be wrong."""
    payloads, count = _poses(configurations, T_map_base)
    fields = {**_header(robot, options), "clearance_m": validation.positive_number(max_clearance_m, "max_clearance_m")}
    read = partial(Clearance.from_frame, count=count)
    return Question("collisions", fields, payloads, read, options.get("min_revision"))


def motion_question(
    robot: str | RobotInfo,
    q_from: ArrayLike | None,
    q_to: ArrayLike | None,
    T_map_base: ArrayLike | None,
    options: MotionOptions,
) -> Question[MotionCheck]:
    """As `Client.check_motion`. Raises InvalidInputError for arguments that can be seen to be wrong."""
    ends = {"q_from": q_from, "q_to": q_to}
    bases = {"T_map_base": T_map_base, "T_map_base_to": options.get("T_map_base_to")}
    payloads: dict[str, NDArray[Any]] = {
        name: validation.configuration_rows(q, name) for name, q in ends.items() if q is not None
    }
    widths = {array.shape[1] for array in payloads.values()}
    payloads |= {name: validation.base_poses(T, name) for name, T in bases.items() if T is not None}
    lengths = {len(array) for array in payloads.values()} - {1}
    if len(lengths) > 1 or len(widths) > 1:
        shapes = " and ".join(f"{name} {array.shape}" for name, array in payloads.items())
        raise InvalidInputError(f"{shapes}: as many of each, or one")
    read = partial(MotionCheck.from_frame, count=max(lengths, default=1))
    return Question("motions", _header(robot, options), payloads, read, options.get("min_revision"))


def _poses(configurations: ArrayLike | None, T_map_base: ArrayLike | None) -> tuple[dict[str, NDArray[Any]], int]:
    """Payloads, and how many poses they are."""
    payloads: dict[str, NDArray[Any]] = {}
    if configurations is not None:
        payloads["configurations"] = validation.configuration_rows(configurations, "configurations")
    if T_map_base is not None:
        payloads["T_map_base"] = validation.base_poses(T_map_base, "T_map_base")
    lengths = {len(array) for array in payloads.values()} - {1}
    if len(lengths) > 1:
        raise InvalidInputError(f"configurations and base poses are {sorted(lengths)}: as many of each, or one")
    return payloads, max(lengths, default=1)


def _header(robot: str | RobotInfo, options: Mapping[str, Any]) -> dict[str, object]:
    """Fields as in docs/frame.md; what is not given is the service's default."""
    name = robot.name if isinstance(robot, RobotInfo) else robot
    fields: dict[str, object] = {key: value for key, value in options.items() if value is not None}
    for of_its_own in ("min_revision", "T_map_base_to"):
        fields.pop(of_its_own, None)
    if (padding_m := options.get("padding_m")) is not None:
        by_link = isinstance(padding_m, Mapping)
        fields["padding_m"] = {k: float(v) for k, v in padding_m.items()} if by_link else float(padding_m)
    if "attached" in fields:
        fields["attached"] = [thing.to_json() for thing in options["attached"]]
    fields |= {key: [list(pair) for pair in options[key]] for key in ("allow", "forbid") if key in fields}
    return {"robot": validation.path_name(name, "robot"), **fields}
