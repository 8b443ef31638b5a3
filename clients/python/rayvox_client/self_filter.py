"""The robot that carries a sensor, to be left out of what the sensor saw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.typing import ArrayLike

from rayvox_client import validation
from rayvox_client.attached_object import AttachedObject
from rayvox_client.errors import InvalidInputError
from rayvox_client.robot_info import RobotInfo


class SelfFilter:
    """Points on the robot's padded body, and rays through it, do not go into the map.

    The sensor's place on the robot is given either by where the base is in the map, or by the link that carries it.
    A link whose padded body holds the sensor stops no rays.

    Args:
        robot: its name, or what `upload_robot` returned.
        configuration: (j,) joint values at the scan's time, radians and metres; None for a robot without joints.
        T_map_base: (4,4) rigid pose of the base at the scan's time.
        sensor_link: the link that carries the sensor; the base by default.
        T_link_sensor: (4,4) rigid pose of the sensor on that link; None for identity.
        padding_m: grows every link; or a mapping, the links it names.
        attached: what the robot holds.

    Raises:
        InvalidInputError: both ways at once, wrong shapes, values that are not finite or not rigid.
    """

    __slots__ = ("_fields",)

    def __init__(
        self,
        robot: str | RobotInfo,
        configuration: ArrayLike | None = None,
        *,
        T_map_base: ArrayLike | None = None,
        sensor_link: str | None = None,
        T_link_sensor: ArrayLike | None = None,
        padding_m: float | Mapping[str, float] = 0.0,
        attached: Sequence[AttachedObject] = (),
    ) -> None:
        if T_map_base is not None and (sensor_link is not None or T_link_sensor is not None):
            raise InvalidInputError("either T_map_base, or sensor_link and T_link_sensor")
        name = robot.name if isinstance(robot, RobotInfo) else robot
        fields: dict[str, object] = {"robot": validation.path_name(name, "robot")}
        if configuration is not None:
            rows = validation.configuration_rows(configuration, "configuration")
            if len(rows) != 1:
                raise InvalidInputError(f"configuration has {len(rows)} rows: a scan is taken at one")
            fields["configuration"] = rows[0].tolist()
        for key, pose in (("T_map_base", T_map_base), ("T_link_sensor", T_link_sensor)):
            if pose is not None:
                fields[key] = validation.rigid_transform(pose, key).ravel().tolist()
        if sensor_link is not None:
            fields["sensor_link"] = sensor_link
        if attached:
            fields["attached"] = [thing.to_json() for thing in attached]
        self._fields = {**fields, "padding_m": dict(padding_m) if isinstance(padding_m, Mapping) else float(padding_m)}

    def to_json(self) -> dict[str, object]:
        """The header's form."""
        return dict(self._fields)

    def __repr__(self) -> str:
        return f"SelfFilter({self._fields['robot']!r})"
