"""The robot that carries a sensor, taken out of a scan before the map or the journal sees it.

What is journaled is the scan that goes into the map, under a kind of its own: replaying it needs no robot. It keeps
what identifies the bytes that were received, so that sending those again is recognised for the life of the map.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator
from rayvox import ScanPoint

from rayvox_service import scan
from rayvox_service.checked_fields import check_fields
from rayvox_service.frame import AnyArray, Frame, encode_frame
from rayvox_service.problems import Problem
from rayvox_service.robot_query import PaddingM
from rayvox_service.robot_variant import AttachedObject, RobotVariant
from rayvox_service.stored_robot import StoredRobot

FIELD = "self_filter"
RobotLookup = Callable[[str], StoredRobot]
Number = Annotated[float, Field(allow_inf_nan=False)]
Matrix = Annotated[tuple[Number, ...], Field(min_length=16, max_length=16)]


class SelfFilter(BaseModel):
    """Where the robot was: its joints, and its base either in the map or by the link that carries the sensor."""

    model_config = ConfigDict(extra="forbid")

    robot: str
    configuration: tuple[Number, ...] | None = None
    T_map_base: Matrix | None = None
    sensor_link: str | None = None
    T_link_sensor: Matrix | None = None
    attached: tuple[AttachedObject, ...] = Field(default=(), max_length=64)
    padding_m: PaddingM | dict[str, PaddingM] = 0.0

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.T_map_base is not None and (self.sensor_link is not None or self.T_link_sensor is not None):
            raise ValueError("either T_map_base or sensor_link and T_link_sensor say where the sensor is on the robot")
        return self

    def classify(
        self, stored: StoredRobot, rays: AnyArray, T_map_sensor: npt.NDArray[np.float64] | None, origin: scan.Vector
    ) -> npt.NDArray[np.uint8]:
        """ScanPoint of each ray's end in the sensor's frame. Raises rayvox.InvalidInputError."""
        variant = RobotVariant(attached=self.attached)
        robot = stored.variant(variant)
        if self.T_map_base is not None:
            T_map_base = np.array(self.T_map_base).reshape(4, 4)
            T_base_sensor = np.linalg.solve(T_map_base, np.eye(4) if T_map_sensor is None else T_map_sensor)
        else:
            link = 0 if self.sensor_link is None else robot.link_index(self.sensor_link)
            T_link_sensor = np.eye(4) if self.T_link_sensor is None else np.array(self.T_link_sensor).reshape(4, 4)
            T_base_sensor = robot.link_poses(self.configuration)[0, link] @ T_link_sensor
        return stored.body_filter(variant).classify(rays, self.configuration, T_base_sensor, origin, self.padding_m)


def without_own_body(frame: Frame, find_robot: RobotLookup, max_points: int) -> bytes:
    """The frame of the scan that is left, as it is journaled. Raises FrameError, Problem, rayvox.InvalidInputError."""
    arguments = scan.scan_arguments(frame, max_points)
    asked = check_fields(_as_object(frame.fields[FIELD]), SelfFilter)
    stored = find_robot(asked.robot)
    kinds = {
        name: asked.classify(stored, rays, arguments.T_map_sensor, arguments.origin)
        for name, rays in (("points", arguments.points), ("no_return", arguments.no_return))
        if rays is not None
    }
    measured = "depth" if "depth" in frame.payloads else "points"
    arrays = {measured: _left_over(frame, measured, kinds["points"])}
    if "no_return" in kinds:
        arrays["no_return"] = _left_over(frame, "no_return", kinds["no_return"])
    if not any((kind == ScanPoint.KEPT).any() for kind in kinds.values()):
        raise Problem("invalid-input", "the scan shows nothing but the robot itself")
    fields = {name: value for name, value in frame.fields.items() if name != FIELD}
    fields["received"] = {"crc32c": frame.crc32c, "nbytes": frame.nbytes}
    fields["dropped"] = {
        "points_on_body": _count(kinds, ScanPoint.ON_BODY),
        "points_behind_body": _count(kinds, ScanPoint.BEHIND_BODY),
    }
    zstd = any(payload.encoding == "zstd" for payload in frame.payloads.values())
    return encode_frame(scan.FILTERED_KIND, fields, arrays, zstd=zstd)


def no_robots(name: str) -> StoredRobot:
    """For maps whose scans name no robots."""
    raise Problem("robot-not-found", f"there is no robot {name}")


def _left_over(frame: Frame, name: str, kinds: npt.NDArray[np.uint8]) -> AnyArray:
    array = frame.array(name)
    if name != "depth":
        return array[kinds == ScanPoint.KEPT]
    image = array.copy()
    rows, columns = np.nonzero(image)
    gone = kinds != ScanPoint.KEPT
    image[rows[gone], columns[gone]] = 0
    return image


def _count(kinds: dict[str, npt.NDArray[np.uint8]], kind: ScanPoint) -> int:
    return sum(int((array == kind).sum()) for array in kinds.values())


def _as_object(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise Problem("invalid-input", f"{FIELD} must be an object")
    return value
