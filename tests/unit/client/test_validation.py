"""What the client refuses before anything is sent."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox_client import (
    AsyncClient,
    Client,
    DepthScan,
    Intrinsics,
    InvalidInputError,
    RefusedInputError,
    Scan,
    SensorModel,
    ServiceError,
)
from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import service_error
from rayvox_client.frame import decode_frame
from rayvox_client.requests import Requests

ONE = [[1.0, 2.0, 3.0]]
LENS = Intrinsics(500, 500, 320, 240)
REQUESTS = Requests(Endpoint.parse("http://robot:8080", None))


def pose(**changed: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    matrix = np.eye(4)
    for place, value in changed.items():
        matrix[int(place[1]), int(place[2])] = value
    return matrix


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([1.0, 2.0, 3.0], "points must have shape (n, 3), got (3,)"),
        ([[1.0, 2.0]], "points must have shape (n, 3), got (1, 2)"),
        (np.zeros((0, 3)), "points is empty"),
        ([[1.0, 2.0, 3.0], [4.0, np.inf, 6.0]], "points[1] = [4.0, inf, 6.0] is not finite (1 of 2 rows)"),
        (np.full((5, 3), np.nan, np.float32), "points[0] = [nan, nan, nan] is not finite (5 of 5 rows)"),
        ([["a", "b", "c"]], "points must hold real numbers"),
        ([[1j, 0, 0]], "points must hold real numbers"),
        ([[1.0, 2.0, 3.0], [4.0]], "points is not an array"),
        (np.zeros((2, 3), np.int16), "int16 points need scale_m"),
    ],
)
def test_points_that_cannot_be_sent_are_named(points: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=re.escape(message)):
        Scan(points)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), "T_map_sensor must have shape (4, 4), got (3, 3)"),
        (pose(p03=np.nan), "T_map_sensor[0, 3] = nan is not finite"),
        (pose(p32=1.0), "T_map_sensor[3] = [0.0, 0.0, 1.0, 1.0]"),
        (pose(p33=2.0), "T_map_sensor[3] = [0.0, 0.0, 0.0, 2.0]"),
        (pose(p00=1.001), "T_map_sensor is not rigid"),
        (pose(p01=0.1), "T_map_sensor is not rigid"),
        (pose(p22=-1.0), "mirrors"),
        (np.zeros((4, 4)), "T_map_sensor[3]"),
    ],
)
def test_a_pose_that_is_not_rigid_is_named(matrix: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=re.escape(message)):
        Scan(ONE, matrix)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"origin": (0, 0)}, "origin must hold three numbers"),
        ({"origin": (0, np.nan, 0)}, "origin[0] = [0.0, nan, 0.0]"),
        ({"max_range_m": 0.0}, "max_range_m = 0.0"),
        ({"max_range_m": np.nan}, "max_range_m = nan"),
        ({"no_return": [[1.0, 2.0]]}, "no_return must have shape"),
        ({"no_return": [[np.inf, 0.0, 0.0]]}, "no_return[0]"),
        ({"scan_id": "scan-1"}, "scan_id = 'scan-1' is not a UUID"),
        ({"stamp_s": np.inf}, "stamp_s"),
        ({"scale_m": 0.001}, "scale_m goes with int16 points"),
    ],
)
def test_options_that_cannot_be_sent_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInputError, match=re.escape(message)):
        Scan(ONE, **options)


def test_a_float32_pose_is_rigid_enough() -> None:
    angle = np.float32(0.7)
    matrix = np.eye(4, dtype=np.float32)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    assert Scan(ONE, matrix).T_map_sensor.dtype == np.float64


def test_a_scan_may_consist_of_beams_without_return_alone() -> None:
    frame = decode_frame(Scan(np.zeros((0, 3)), no_return=ONE).to_frame())
    assert frame.payloads["points"].shape == (0, 3)
    assert frame.payloads["no_return"].tolist() == ONE


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_are_not_copied_before_they_are_sent(dtype: type) -> None:
    points: NDArray[Any] = np.ones((4, 3), dtype)
    assert Scan(points).points is points


def test_other_numbers_go_as_float64_and_half_floats_as_float32() -> None:
    assert Scan([[1, 2, 3]]).points.dtype == np.float64
    assert Scan(np.ones((1, 3), np.float16)).points.dtype == np.float32
    assert decode_frame(Scan(np.ones((1, 3), np.int16), scale_m=0.001).to_frame()).payloads["points"].dtype == np.int16


@pytest.mark.parametrize("depth", [np.zeros((2, 2)), np.zeros(4, np.uint16), np.zeros((0, 3), np.uint16)])
def test_a_depth_image_is_uint16_with_rows_and_columns(depth: Any) -> None:
    with pytest.raises(InvalidInputError, match="depth"):
        DepthScan(depth, LENS)


def test_parameters_out_of_range_are_named() -> None:
    with pytest.raises(InvalidInputError, match="fx = 0"):
        Intrinsics(0, 500, 320, 240)
    with pytest.raises(InvalidInputError, match=r"p_hit = 1\.5"):
        SensorModel(p_hit=1.5)
    with pytest.raises(InvalidInputError, match="depth = 22"):
        REQUESTS.create_map("m", 0.1, 22, None)
    with pytest.raises(InvalidInputError, match="resolution_m = -1"):
        REQUESTS.create_map("m", -1, 16, None)


def test_boxes_and_rays_name_the_row_that_is_wrong() -> None:
    with pytest.raises(InvalidInputError, match=re.escape("box 1: lo[1] = [0.0, 5.0, 0.0] is above")):
        REQUESTS.boxes("m", [[0, 0, 0], [0, 5, 0]], [[1, 1, 1], [1, 1, 1]], None)
    with pytest.raises(InvalidInputError, match="one row per box"):
        REQUESTS.boxes("m", [[0, 0, 0]], [[1, 1, 1], [1, 1, 1]], None)
    with pytest.raises(InvalidInputError, match=re.escape("directions[1] = [0, 0, 0]")):
        REQUESTS.rays("m", [[0, 0, 0]], [[1, 0, 0], [0, 0, 0]], 5, "free", None)
    with pytest.raises(InvalidInputError, match="one row per ray"):
        REQUESTS.rays("m", [[0, 0, 0]] * 3, [[1, 0, 0]] * 2, 5, "free", None)
    with pytest.raises(InvalidInputError, match="unknown = 'maybe'"):
        REQUESTS.rays("m", [[0, 0, 0]], [[1, 0, 0]], 5, "maybe", None)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\n"])
def test_a_map_name_cannot_change_the_path(name: str) -> None:
    with pytest.raises(InvalidInputError, match="map name"):
        REQUESTS.map_info(name, statistics=False)


def test_other_map_names_are_escaped_for_the_service_to_judge() -> None:
    assert REQUESTS.map_info("a b?c#d%", statistics=False).target == "/v1/maps/a%20b%3Fc%23d%25"


@pytest.mark.parametrize(
    "url", ["robot:8080", "ftp://robot", "http://", "http://robot:x", "http://robot?q=1", "http://u:p@robot", ""]
)
@pytest.mark.parametrize("client_type", [Client, AsyncClient])
def test_an_address_that_is_none_is_refused(url: str, client_type: type[Client] | type[AsyncClient]) -> None:
    with pytest.raises(InvalidInputError):
        client_type(url)


def test_an_address_may_have_a_prefix_and_be_ipv6() -> None:
    endpoint = Endpoint.parse("https://[::1]:9000/maps-service/", None)
    assert endpoint.target("health") == "/maps-service/v1/health"
    assert endpoint.websocket_url("/x") == "wss://[::1]:9000/x"
    assert Endpoint.parse("https://robot", None).port == 443


@pytest.mark.parametrize("key", ["", " key", "key\r\nX-Evil: 1", "schlüssel"])
def test_an_api_key_cannot_break_the_header(key: str) -> None:
    with pytest.raises(InvalidInputError, match="api_key"):
        Client("http://robot", key)


def test_errors_survive_pickling_and_say_what_happened() -> None:
    error = service_error(422, "out-of-range", "points[3] is too far", None)
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), copy.status, copy.slug, str(copy)) == (
        type(error),
        422,
        "out-of-range",
        "points[3] is too far [422 out-of-range]",
    )
    assert isinstance(copy, RefusedInputError)
    assert isinstance(copy, InvalidInputError)
    assert isinstance(copy, ServiceError)


def test_importing_the_client_imports_neither_the_kernel_nor_open3d() -> None:
    code = "import rayvox_client, sys; print([m for m in ('rayvox', 'rayvox_service', 'open3d') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
