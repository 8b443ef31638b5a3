"""Scans that come as PCD or PLY files: converted to a scan frame, then treated like any other."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Literal

from rayvox.scan_io import decode_cloud

from rayvox_service import self_filter
from rayvox_service.checked_fields import parse_json
from rayvox_service.frame import encode_frame
from rayvox_service.problems import Problem
from rayvox_service.scan import KIND
from rayvox_service.self_filter import SelfFilter

POINT_CLOUD_TYPES: dict[str, Literal["pcd", "ply"]] = {
    "application/vnd.pcd": "pcd",
    "model/vnd.ply": "ply",
    "model/ply": "ply",
}


def point_cloud_to_frame(
    media: str, data: bytes, scan_id: uuid.UUID, parameters: Mapping[str, str], max_points: int
) -> bytes:
    """The file's points as a frame, with the pose, the range and the self-filter (JSON) from query parameters.

    The same file and parameters give the same bytes, so a retry is seen as one. Raises Problem,
    rayvox.errors.ScanFormatError, MissingDependencyError.
    """
    fields: dict[str, object] = {"scan_id": str(scan_id)}
    if "T_map_sensor" in parameters:
        fields["T_map_sensor"] = _floats(parameters, "T_map_sensor", 16)
    if "origin" in parameters:
        fields["origin"] = _floats(parameters, "origin", 3)
    if "max_range_m" in parameters:
        fields["max_range_m"] = _floats(parameters, "max_range_m", 1)[0]
    if self_filter.FIELD in parameters:
        asked = parse_json(parameters[self_filter.FIELD].encode(), SelfFilter)
        fields[self_filter.FIELD] = asked.model_dump(mode="json", exclude_unset=True)
    points = decode_cloud(data, POINT_CLOUD_TYPES[media], max_points).points
    return encode_frame(KIND, fields, {"points": points})


def _floats(parameters: Mapping[str, str], name: str, count: int) -> list[float]:
    try:
        values = [float(text) for text in parameters[name].split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(abs(value) < float("inf") for value in values):
        raise Problem("invalid-input", f"{name} must be {count} comma-separated finite numbers")
    return values
