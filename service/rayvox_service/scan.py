"""From a scan frame to the kernel's prepared scan: which fields and payloads a scan has, and what they must be."""

from __future__ import annotations

import uuid
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from rayvox import OccupancyMap, PreparedScan
from rayvox.ray_sampling import kept_rays
from rayvox.scan_io import DepthIntrinsics, depth_to_points

from rayvox_service.frame import AnyArray, Frame, FrameTooLargeError
from rayvox_service.map_config import InsertionConfig
from rayvox_service.problems import Problem

KIND = "scan"
# A scan that was received with more in it; only the journal has these.
FILTERED_KIND = "filtered_scan"
Vector = tuple[float, float, float]
FLOATS = ("<f4", "<f8")


@dataclass(frozen=True, slots=True)
class ScanArguments:
    """What the kernel is given for one scan: sensor frame, metres."""

    points: AnyArray
    T_map_sensor: npt.NDArray[np.float64] | None
    origin: Vector
    max_range_m: float | None
    no_return: AnyArray | None
    discretize: bool

    def reduced(self, insertion: InsertionConfig) -> ScanArguments:
        """What of the scan a map with this configuration takes."""
        points, no_return, share = self.points, self.no_return, insertion.ray_share
        if share < 1.0:
            points = points[kept_rays(len(points), share)]
            no_return = None if no_return is None else no_return[kept_rays(len(no_return), share)]
        ranges = [r for r in (self.max_range_m, insertion.max_range_m) if r is not None]
        return replace(
            self,
            points=points,
            no_return=no_return,
            max_range_m=min(ranges, default=None),
            discretize=self.discretize or insertion.discretize,
        )

    def prepare(self, occupancy_map: OccupancyMap) -> PreparedScan:
        return occupancy_map.prepare_scan(
            self.points,
            self.T_map_sensor,
            origin=self.origin,
            max_range_m=self.max_range_m,
            no_return=self.no_return,
            discretize=self.discretize,
        )


def parse_scan_id(text: object) -> uuid.UUID:
    """Only the canonical form, so that one scan has one spelling. Raises Problem invalid-input."""
    try:
        scan_id = uuid.UUID(text) if isinstance(text, str) else None
    except ValueError:
        scan_id = None
    if scan_id is None or str(scan_id) != str(text).lower():
        raise Problem("invalid-input", f"scan_id {str(text)[:60]!r} is not a UUID like {uuid.UUID(int=0)}")
    return scan_id


def scan_arguments(frame: Frame, max_points: int | None = None) -> ScanArguments:
    """Read a `scan` frame. Raises FrameError, FrameTooLargeError (over `max_points`, nothing expanded), or Problem."""
    if frame.kind not in (KIND, FILTERED_KIND):
        raise Problem("invalid-input", f"a scan frame is needed, this one is of kind {frame.kind!r}")
    _check_ray_count(frame, max_points)
    pose = numbers(frame, "T_map_sensor", 16, None)
    origin = numbers(frame, "origin", 3, [0.0, 0.0, 0.0])
    assert origin is not None
    discretize = frame.fields.get("discretize", False)
    if not isinstance(discretize, bool):
        raise Problem("invalid-input", "discretize must be true or false")
    if ("points" in frame.payloads) == ("depth" in frame.payloads):
        raise Problem("invalid-input", "a scan has either points or depth")
    return ScanArguments(
        points=_depth_points(frame) if "depth" in frame.payloads else _points(frame),
        T_map_sensor=None if pose is None else np.array(pose).reshape(4, 4),
        origin=(origin[0], origin[1], origin[2]),
        max_range_m=_number(frame.fields, "max_range_m", None),
        no_return=_directions(frame, "no_return") if "no_return" in frame.payloads else None,
        discretize=discretize,
    )


def _check_ray_count(frame: Frame, max_points: int | None) -> None:
    counts = {"points": 0, "no_return": 0, "depth": 0}
    for name, payload in frame.payloads.items():
        if name not in counts:
            raise Problem("invalid-input", f"a scan has no payload named {name!r}")
        if len(payload.shape) != 2 or (name != "depth" and payload.shape[1] != 3):
            expected = "(rows, columns)" if name == "depth" else "(n, 3)"
            raise Problem("invalid-input", f"{name} has shape {list(payload.shape)}, needed is {expected}")
        counts[name] = payload.shape[0] * payload.shape[1] if name == "depth" else payload.shape[0]
    total = sum(counts.values())
    if max_points is not None and total > max_points:
        raise FrameTooLargeError(f"the scan has {total} rays, the limit is {max_points}")


def _points(frame: Frame) -> AnyArray:
    points = frame.array("points")
    if points.dtype.str in FLOATS:
        return points
    if points.dtype.str != "<i2":
        raise Problem("invalid-input", f"points are <f4, <f8 or <i2 with scale_m, not {points.dtype.str}")
    scale_m = _number(frame.fields, "scale_m", None)
    if scale_m is None or scale_m <= 0:
        raise Problem("invalid-input", "integer points need scale_m > 0, metres per unit")
    return np.asarray(points * np.float64(scale_m))


def _directions(frame: Frame, name: str) -> AnyArray:
    array = frame.array(name)
    if array.dtype.str not in FLOATS:
        raise Problem("invalid-input", f"{name} is <f4 or <f8, not {array.dtype.str}")
    return array


def _depth_points(frame: Frame) -> npt.NDArray[np.float32]:
    fields = frame.fields.get("intrinsics")
    if not isinstance(fields, dict):
        raise Problem("invalid-input", "a depth image needs intrinsics: fx, fy, cx, cy, depth_scale_m")
    values = [_number(fields, key, None) for key in ("fx", "fy", "cx", "cy", "depth_scale_m")]
    fx, fy, cx, cy, scale_m = (float("nan") if value is None else value for value in values)
    return depth_to_points(frame.array("depth"), DepthIntrinsics(fx, fy, cx, cy, scale_m))


def _number(fields: dict[str, Any], name: str, default: float | None) -> float | None:
    value = fields.get(name)
    if value is None:
        return default
    if type(value) not in (int, float):
        raise Problem("invalid-input", f"{name} must be a number")
    return _as_float(value, name)


def numbers(frame: Frame, name: str, count: int, default: list[float] | None) -> list[float] | None:
    values = frame.fields.get(name)
    if values is None:
        return default
    if not isinstance(values, list) or len(values) != count or not all(type(v) in (int, float) for v in values):
        raise Problem("invalid-input", f"{name} must be a list of {count} numbers")
    return [_as_float(value, name) for value in values]


def _as_float(value: float, name: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise Problem("invalid-input", f"{name} is too large for a number") from None
