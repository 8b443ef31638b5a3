"""Every request of the API as a value; no I/O."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rayvox_client import validation
from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import InvalidInputError
from rayvox_client.frame import MEDIA_TYPE, Compression, lay_out_frame
from rayvox_client.http_message import HttpRequest
from rayvox_client.intrinsics import Intrinsics
from rayvox_client.question import Question
from rayvox_client.robot_upload import RobotUpload
from rayvox_client.scan import PosedScan
from rayvox_client.sensor_model import SensorModel

T = TypeVar("T")

EXPORT_FORMATS = ("bt", "ot", "ply")
GEOMETRIES = ("collision", "visual")


class Requests:
    """Builds the requests to one service; InvalidInputError for arguments that can be seen to be wrong."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def get(self, path: str) -> HttpRequest:
        """A plain GET below /v1."""
        return HttpRequest("GET", self._endpoint.target(path))

    def create_map(
        self, name: str, resolution_m: float | None, depth: int | None, sensor_model: SensorModel | None
    ) -> HttpRequest:
        body: dict[str, object] = {"name": name}
        if resolution_m is not None:
            body["resolution_m"] = validation.positive_number(resolution_m, "resolution_m")
        if depth is not None:
            if not 1 <= depth <= 21:
                raise InvalidInputError(f"depth = {depth!r} does not lie in 1 to 21")
            body["depth"] = int(depth)
        if sensor_model is not None:
            body["sensor_model"] = sensor_model.to_json()
        return self._json("POST", self._endpoint.target("maps"), body)

    def map_info(self, name: str, statistics: bool) -> HttpRequest:
        return HttpRequest("GET", self._endpoint.map_target(name, statistics=statistics or None))

    def delete_map(self, name: str) -> HttpRequest:
        return HttpRequest("DELETE", self._endpoint.map_target(name))

    def put_scan(self, name: str, scan: PosedScan, wait: str, compression: Compression) -> HttpRequest:
        if wait not in ("applied", "journaled"):
            raise InvalidInputError(f"wait = {wait!r} is neither 'applied' nor 'journaled'")
        target = self._endpoint.map_target(name, f"scans/{scan.scan_id}", wait=wait)
        return HttpRequest("PUT", target, scan.lay_out_frame(compression), MEDIA_TYPE)

    def points(
        self, name: str, points: ArrayLike, depth: int | None, min_revision: int | None
    ) -> tuple[HttpRequest, int]:
        """The query and how many answers it is to have."""
        asked = validation.points_array(points, "points", allow_empty=True)
        fields = {} if depth is None else {"depth": int(depth)}
        return self._query(name, "points", fields, {"points": asked}, min_revision), len(asked)

    def boxes(self, name: str, lo: ArrayLike, hi: ArrayLike, min_revision: int | None) -> tuple[HttpRequest, int]:
        """The query and how many answers it is to have."""
        lower, upper = validation.box_corners(lo, hi)
        return self._query(name, "boxes", {}, {"lo": lower, "hi": upper}, min_revision), len(lower)

    def rays(
        self,
        name: str,
        origins: ArrayLike,
        directions: ArrayLike,
        max_range_m: float,
        unknown: str,
        min_revision: int | None,
    ) -> tuple[HttpRequest, int]:
        """The query and how many answers it is to have."""
        starts = validation.points_array(origins, "origins", allow_empty=True)
        along = validation.points_array(directions, "directions", allow_empty=True)
        if len(starts) == 1 and len(along) > 1:
            starts = np.ascontiguousarray(np.broadcast_to(starts, along.shape))
        if starts.shape != along.shape:
            raise InvalidInputError(f"origins has shape {starts.shape} and directions {along.shape}: one row per ray")
        still = np.flatnonzero(~along.any(axis=1))
        if still.size:
            raise InvalidInputError(f"directions[{still[0]}] = [0, 0, 0] points nowhere")
        if unknown not in ("free", "occupied"):
            raise InvalidInputError(f"unknown = {unknown!r} is neither 'free' nor 'occupied'")
        fields = {"max_range_m": validation.positive_number(max_range_m, "max_range_m"), "unknown": unknown}
        payloads = {"origins": starts, "directions": along}
        return self._query(name, "rays", fields, payloads, min_revision), len(starts)

    def depth_image(
        self,
        name: str,
        shape: tuple[int, int],
        intrinsics: Intrinsics,
        T_map_camera: ArrayLike,
        max_range_m: float | None,
        unknown: str,
    ) -> HttpRequest:
        rows, columns = int(shape[0]), int(shape[1])
        if rows < 1 or columns < 1:
            raise InvalidInputError(f"shape = {shape!r} is no image")
        if unknown not in ("free", "occupied"):
            raise InvalidInputError(f"unknown = {unknown!r} is neither 'free' nor 'occupied'")
        body: dict[str, object] = {
            "T_map_camera": validation.rigid_transform(T_map_camera, "T_map_camera").reshape(-1).tolist(),
            "width": columns,
            "height": rows,
            **{key: getattr(intrinsics, key) for key in ("fx", "fy", "cx", "cy")},
            "max_range_m": validation.positive_number(max_range_m, "max_range_m"),
            "unknown": unknown,
        }
        return self._json("POST", self._endpoint.map_target(name, "depth_image", format="frame"), body)

    def question(self, name: str, question: Question[T]) -> HttpRequest:
        target = self._endpoint.map_target(name, question.kind, min_revision=question.min_revision)
        return HttpRequest("POST", target, question.lay_out_frame(), MEDIA_TYPE)

    def clear_box(self, name: str, lo: ArrayLike, hi: ArrayLike) -> HttpRequest:
        lower, upper = validation.vector3(lo, "lo"), validation.vector3(hi, "hi")
        validation.box_corners([lower], [upper])
        return self._json("POST", self._endpoint.map_target(name, "clear"), {"lo": lower, "hi": upper})

    def changes(self, name: str, since: int) -> HttpRequest:
        return HttpRequest("GET", self._endpoint.map_target(name, "changes", since=int(since)))

    def export(self, name: str, suffix: str) -> HttpRequest:
        if suffix not in EXPORT_FORMATS:
            raise InvalidInputError(f"cannot export as {suffix!r}: the file name ends in .bt, .ot or .ply")
        return HttpRequest("GET", self._endpoint.map_target(name, "export", format=suffix))

    def put_robot(self, upload: RobotUpload, name: str, scale: float, geometry: str) -> HttpRequest:
        validation.positive_number(scale, "scale")
        if geometry not in GEOMETRIES:
            raise InvalidInputError(f"geometry = {geometry!r} is neither 'collision' nor 'visual'")
        query = {"scale": float(scale), "geometry": geometry, "description": upload.description}
        return HttpRequest("PUT", self._endpoint.robot_target(name, **query), upload.data, upload.media_type)

    def robot_info(self, name: str) -> HttpRequest:
        return HttpRequest("GET", self._endpoint.robot_target(name))

    def delete_robot(self, name: str) -> HttpRequest:
        return HttpRequest("DELETE", self._endpoint.robot_target(name))

    def _query(
        self,
        name: str,
        kind: str,
        fields: Mapping[str, object],
        payloads: Mapping[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]],
        min_revision: int | None,
    ) -> HttpRequest:
        target = self._endpoint.map_target(name, kind, min_revision=min_revision)
        return HttpRequest("POST", target, lay_out_frame(kind, fields, payloads), MEDIA_TYPE)

    @staticmethod
    def _json(method: str, target: str, body: Mapping[str, object]) -> HttpRequest:
        return HttpRequest(method, target, json.dumps(body, allow_nan=False).encode(), "application/json")
