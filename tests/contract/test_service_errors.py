from __future__ import annotations

import json
import socket
import struct
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import google_crc32c
import httpx
import numpy as np
import pytest
from rayvox_service.frame import encode_frame

from tests.support.service_process import (
    FRAME_HEADERS,
    ServiceProcess,
    assert_problem,
    create_map,
    put_scan,
    scan_frame,
    served_leaves,
    some_points,
)

MIB = 1 << 20


@pytest.mark.parametrize("path", ["/", "/v1", "/v1/nothing", "/v2/maps", "/v1/maps/a/b/c"])
def test_an_unknown_address_is_not_found(service: ServiceProcess, path: str) -> None:
    assert_problem(service.http.get(path), 404, "not-found")


@pytest.mark.parametrize(
    ("method", "path"), [("DELETE", "/v1/maps"), ("PUT", "/v1/health"), ("GET", "/v1/maps/a/rays")]
)
def test_a_wrong_method_names_the_allowed_ones(service: ServiceProcess, method: str, path: str) -> None:
    response = service.http.request(method, path)
    assert_problem(response, 405, "method-not-allowed")
    assert response.headers["allow"]


def test_every_route_of_a_missing_map_says_so(service: ServiceProcess) -> None:
    query = {"content-type": "application/json"}
    scan_id, data = scan_frame(some_points())
    answers = [
        service.http.get("/v1/maps/none"),
        service.http.delete("/v1/maps/none"),
        service.http.get("/v1/maps/none/changes"),
        service.http.get("/v1/maps/none/export?format=bt"),
        put_scan(service.http, "none", scan_id, data),
        *(service.http.post(f"/v1/maps/none/{what}", content=b"{}", headers=query) for what in ("points", "clear")),
    ]
    for answer in answers:
        assert_problem(answer, 404, "map-not-found")


@pytest.mark.parametrize(
    "name", ["", ".", "..", "../up", "a/b", ".hidden", "-x", "a\n", "a b", "ä", "x" * 65, "a\\b", "\u0000", "%2e%2e"]
)
def test_a_name_that_could_leave_the_data_directory_is_refused(service: ServiceProcess, name: str) -> None:
    response = service.http.post("/v1/maps", json={"name": name, "resolution_m": 0.1})
    assert_problem(response, 422, "invalid-map-name")


@pytest.mark.parametrize("path", ["/v1/maps/%2e%2e", "/v1/maps/..%2f..%2fetc", "/v1/maps/.hidden", "/v1/maps/a%00b"])
def test_an_address_that_could_leave_the_data_directory_reaches_no_map(service: ServiceProcess, path: str) -> None:
    for method in ("GET", "DELETE"):
        request = httpx.Request(method, service.url + path)
        response = service.http.send(request)
        assert response.status_code in (404, 422)
        assert response.headers["content-type"] == "application/problem+json"


def test_an_existing_name_is_a_conflict_and_leaves_the_map_alone(service: ServiceProcess, lab: str) -> None:
    put_scan(service.http, lab, *scan_frame(some_points()))
    assert_problem(service.http.post("/v1/maps", json={"name": lab, "resolution_m": 1.0}), 409, "map-exists")
    assert service.http.get(f"/v1/maps/{lab}").json()["scans_applied"] == 1


@pytest.mark.parametrize(
    "change",
    [
        {"resolution_m": 0},
        {"resolution_m": -1},
        {"resolution_m": "fine"},
        {"resolution_m": None},
        {"depth": 0},
        {"depth": 22},
        {"depth": 1.5},
        {"sensor_model": {"p_hit": 0.3}},
        {"sensor_model": {"p_hit": 2}},
        {"sensor_model": {"p_miss": 0.9}},
        {"sensor_model": {"p_clamp_min": 0.99, "p_clamp_max": 0.5}},
        {"sensor_model": {"p_other": 0.5}},
        {"surprise": 1},
    ],
)
def test_a_map_that_cannot_be_is_refused_and_not_there_afterwards(
    service: ServiceProcess, change: dict[str, Any]
) -> None:
    response = service.http.post("/v1/maps", json={"name": "impossible", "resolution_m": 0.1, **change})
    assert_problem(response, 422, "invalid-input")
    assert_problem(service.http.get("/v1/maps/impossible"), 404, "map-not-found")


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b'"text"', b"\xff\xfe", b"[" * 50_000])
def test_a_body_that_is_no_such_json_is_refused(service: ServiceProcess, lab: str, body: bytes) -> None:
    for path in ("/v1/maps", f"/v1/maps/{lab}/points", f"/v1/maps/{lab}/clear"):
        response = service.http.post(path, content=body, headers={"content-type": "application/json"})
        assert_problem(response, 422, "invalid-input")


@pytest.mark.parametrize("media", ["text/plain", "application/x-www-form-urlencoded", "application/octet-stream", ""])
def test_another_media_type_is_named(service: ServiceProcess, lab: str, media: str) -> None:
    scan_id, data = scan_frame(some_points())
    headers = {"content-type": media}
    answers = [
        service.http.put(f"/v1/maps/{lab}/scans/{scan_id}", content=data, headers=headers),
        service.http.post(f"/v1/maps/{lab}/points", content=data, headers=headers),
        service.http.post("/v1/maps", content=b"{}", headers=headers),
    ]
    for answer in answers:
        assert_problem(answer, 415, "unsupported-media-type")


def test_a_content_encoding_is_not_taken(service: ServiceProcess, lab: str) -> None:
    scan_id, data = scan_frame(some_points())
    response = put_scan(service.http, lab, scan_id, data, **{"Content-Encoding": "gzip"})
    assert_problem(response, 415, "unsupported-media-type")


@pytest.mark.parametrize(
    "scan_id", ["1", "not-a-uuid", "00112233445566778899aabbccddeeff", "{" + str(uuid.uuid4()) + "}"]
)
def test_a_scan_id_that_is_no_uuid_is_refused(service: ServiceProcess, lab: str, scan_id: str) -> None:
    assert_problem(put_scan(service.http, lab, scan_id, scan_frame(some_points())[1]), 422, "invalid-input")


def test_a_frame_of_another_scan_than_the_addresss_is_refused(service: ServiceProcess, lab: str) -> None:
    response = put_scan(service.http, lab, uuid.uuid4(), scan_frame(some_points())[1])
    assert_problem(response, 422, "invalid-input")


def test_an_unknown_wait_is_refused(service: ServiceProcess, lab: str) -> None:
    response = put_scan(service.http, lab, *scan_frame(some_points()), wait="forever")
    assert_problem(response, 422, "invalid-input")


def claim_points(
    count: int, payload: bytes, encoding: str = "raw", nbytes: int | None = None
) -> tuple[uuid.UUID, bytes]:
    """A scan frame with a right CRC that claims `count` points, whatever its payload is."""
    scan_id = uuid.uuid4()
    entry = {"name": "points", "dtype": "<f4", "shape": [count, 3], "offset": 384, "encoding": encoding}
    document = {"kind": "scan", "scan_id": str(scan_id), "payloads": [{**entry, "nbytes": nbytes or len(payload)}]}
    header = json.dumps(document).encode()
    body = header + bytes(384 - 24 - len(header)) + payload
    prefix = struct.pack("<4sIQ", b"RVX1", len(header), 24 + len(body))
    return scan_id, prefix + struct.pack("<II", google_crc32c.value(body), 0) + body


def zstd_bomb() -> tuple[uuid.UUID, bytes]:
    scan_id, data = scan_frame(np.zeros((100_000_000, 3), "<i2"), zstd=True, scale_m=0.001)
    assert len(data) < 100_000
    return scan_id, data


def corrupt(data: bytes, position: int) -> bytes:
    return data[:position] + bytes([data[position] ^ 1]) + data[position + 1 :]


BAD_SCANS: dict[str, tuple[Callable[[], tuple[uuid.UUID, bytes]], int, str]] = {
    "no bytes": (lambda: (uuid.uuid4(), b""), 400, "invalid-frame"),
    "wrong magic": (lambda: (uuid.uuid4(), b"PCD1" + bytes(100)), 400, "invalid-frame"),
    "wrong CRC": (lambda: (uuid.uuid4(), corrupt(scan_frame(some_points())[1], 600)), 400, "invalid-frame"),
    "cut short": (lambda: (uuid.uuid4(), scan_frame(some_points())[1][:-1]), 400, "invalid-frame"),
    "bytes behind": (lambda: (uuid.uuid4(), scan_frame(some_points())[1] + b"\0"), 400, "invalid-frame"),
    "lying size": (lambda: claim_points(100, bytes(1199)), 400, "invalid-frame"),
    "lying stored size": (lambda: claim_points(100, bytes(1200), nbytes=1 << 40), 400, "invalid-frame"),
    "a billion points": (lambda: claim_points(1_000_000_000, bytes(1200)), 413, "too-large"),
    "a billion compressed points": (lambda: claim_points(1_000_000_000, bytes(99), "zstd"), 413, "too-large"),
    "a zstd bomb": (zstd_bomb, 413, "too-large"),
    "too many points": (lambda: scan_frame(np.zeros((2_000_001, 3), "<f4")), 413, "too-large"),
    "no zstd at all": (lambda: claim_points(100, bytes(99), "zstd"), 400, "invalid-frame"),
    "NaN": (lambda: scan_frame(np.array([[0, np.nan, 0]], "<f4")), 422, "invalid-input"),
    "infinity": (lambda: scan_frame(np.array([[np.inf, 0, 0]], "<f8")), 422, "invalid-input"),
    "no points": (lambda: scan_frame(np.zeros((0, 3), "<f4")), 422, "invalid-input"),
    "two columns": (lambda: scan_frame(np.zeros((9, 2), "<f4")), 422, "invalid-input"),
    "a pose that scales": (
        lambda: scan_frame(some_points(), T_map_sensor=(np.eye(4) * 2).ravel().tolist()),
        422,
        "invalid-input",
    ),
    "a point beyond the octree": (lambda: scan_frame(np.array([[1e9, 0, 0]], "<f8")), 422, "out-of-range"),
    "a query": (lambda: (uuid.uuid4(), encode_frame("points", {}, {"points": some_points()})), 422, "invalid-input"),
    "a clear_box": (lambda: (uuid.uuid4(), encode_frame("clear_box", {}, {})), 422, "invalid-input"),
}


@pytest.mark.parametrize("name", BAD_SCANS)
def test_a_bad_scan_is_named_and_changes_nothing(service: ServiceProcess, lab: str, name: str) -> None:
    make, status, slug = BAD_SCANS[name]
    put_scan(service.http, lab, *scan_frame(some_points()))
    before = (service.http.get(f"/v1/maps/{lab}").json(), served_leaves(service.http, lab))
    assert_problem(put_scan(service.http, lab, *make()), status, slug)
    assert (service.http.get(f"/v1/maps/{lab}").json(), served_leaves(service.http, lab)) == before


def whole_answer(connection: socket.socket) -> bytes:
    answer = b""
    while not answer.endswith(b"}"):
        received = connection.recv(65536)
        assert received, answer
        answer += received
    return answer


def test_a_body_that_announces_too_much_is_refused_before_it_comes(service: ServiceProcess, lab: str) -> None:
    address = httpx.URL(service.url)
    with socket.create_connection((address.host, address.port or 80), timeout=20) as connection:
        connection.sendall(
            f"PUT /v1/maps/{lab}/scans/{uuid.uuid4()} HTTP/1.1\r\nHost: x\r\n"
            f"Content-Type: {FRAME_HEADERS['Content-Type']}\r\nContent-Length: {1 << 40}\r\n\r\n".encode()
        )
        answer = whole_answer(connection)
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert b"urn:rayvox:problem:too-large" in answer


@pytest.fixture(scope="module")
def small_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service with narrow limits."""
    data_dir = tmp_path_factory.mktemp("small")
    with ServiceProcess(data_dir, max_body_bytes=20_000, body_timeout_s=0.5, max_json_bytes=500) as running:
        create_map(running.await_ready().http, "lab")
        yield running


def test_a_body_without_a_length_is_refused_where_it_passes_the_limit(small_service: ServiceProcess) -> None:
    def endless() -> Iterator[bytes]:
        for _ in range(100):
            yield bytes(1000)

    url = f"/v1/maps/lab/scans/{uuid.uuid4()}"
    assert_problem(small_service.http.put(url, content=endless(), headers=FRAME_HEADERS), 413, "too-large")


def test_json_is_held_to_a_smaller_limit_than_frames(small_service: ServiceProcess) -> None:
    points = [[0.0, 0.0, 0.0]] * 200
    assert_problem(small_service.http.post("/v1/maps/lab/points", json={"points": points}), 413, "too-large")
    data = encode_frame("points", {}, {"points": np.array(points)})
    assert small_service.http.post("/v1/maps/lab/points", content=data, headers=FRAME_HEADERS).status_code == 200


def test_a_body_that_does_not_arrive_is_given_up(small_service: ServiceProcess) -> None:
    address = httpx.URL(small_service.url)
    with socket.create_connection((address.host, address.port or 80), timeout=20) as connection:
        connection.sendall(
            f"PUT /v1/maps/lab/scans/{uuid.uuid4()} HTTP/1.1\r\nHost: x\r\n"
            f"Content-Type: {FRAME_HEADERS['Content-Type']}\r\nContent-Length: 10000\r\n\r\nRVX1".encode()
        )
        answer = whole_answer(connection)
    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b"urn:rayvox:problem:request-timeout" in answer


@pytest.mark.parametrize(
    ("path", "query"),
    [
        ("points", {}),
        ("points", {"points": [[0, 0]]}),
        ("points", {"points": [[0, 0, None]]}),
        ("points", {"points": [[0, 0, 0]], "depth": 17}),
        ("points", {"points": [[0, 0, 0]], "depth": -1}),
        ("points", {"points": [[0, 0, 0]], "dept": 3}),
        ("boxes", {"lo": [[0, 0, 0]]}),
        ("boxes", {"lo": [[0, 0, 0]], "hi": [[1, 1, 1], [2, 2, 2]]}),
        ("boxes", {"lo": [[1, 1, 1]], "hi": [[0, 0, 0]]}),
        ("rays", {"origins": [[0, 0, 0]], "directions": [[0, 0, 0]], "max_range_m": 1}),
        ("rays", {"origins": [[0, 0, 0]], "directions": [[1, 0, 0]], "max_range_m": -1}),
        ("rays", {"origins": [[0, 0, 0]], "directions": [[1, 0, 0]], "max_range_m": 1, "unknown": "maybe"}),
        ("clear", {"lo": [0, 0, 0]}),
        ("clear", {"lo": [1, 1, 1], "hi": [0, 0, 0]}),
        ("clear", {"lo": [0, 0], "hi": [0, 0]}),
    ],
)
def test_a_query_that_makes_no_sense_is_refused(
    service: ServiceProcess, lab: str, path: str, query: dict[str, Any]
) -> None:
    assert_problem(service.http.post(f"/v1/maps/{lab}/{path}", json=query), 422, "invalid-input")
    assert service.http.get(f"/v1/maps/{lab}").json()["last_sequence"] == 0


@pytest.mark.parametrize(
    "query",
    ["changes?since=-1", "changes?since=x", "export", "export?format=stl", "changes?since=99999999999999999999"],
)
def test_a_parameter_that_makes_no_sense_is_refused(service: ServiceProcess, lab: str, query: str) -> None:
    assert_problem(service.http.get(f"/v1/maps/{lab}/{query}"), 422, "invalid-input")


@pytest.mark.parametrize("wrong", [{"kind": "boxes"}, {"dtype": "<i4"}, {"shape": (3,)}, {"name": "pts"}])
def test_a_query_frame_that_does_not_fit_its_address_is_refused(
    service: ServiceProcess, lab: str, wrong: dict[str, Any]
) -> None:
    points = np.zeros(wrong.get("shape", (1, 3)), wrong.get("dtype", "<f8"))
    data = encode_frame(wrong.get("kind", "points"), {}, {wrong.get("name", "points"): points})
    response = service.http.post(f"/v1/maps/{lab}/points", content=data, headers=FRAME_HEADERS)
    assert_problem(response, 422, "invalid-input")


def test_a_revision_that_does_not_come_times_out(service: ServiceProcess, lab: str) -> None:
    url = f"/v1/maps/{lab}/points?min_revision=1&timeout_s=0.05"
    assert_problem(service.http.post(url, json={"points": [[0, 0, 0]]}), 504, "timeout")


def test_the_same_id_with_other_bytes_is_a_conflict(service: ServiceProcess, lab: str) -> None:
    scan_id, data = scan_frame(some_points(1))
    assert put_scan(service.http, lab, scan_id, data).status_code == 201
    problem = assert_problem(put_scan(service.http, lab, *scan_frame(some_points(2), scan_id)), 409, "scan-conflict")
    assert problem["scan_id"] == str(scan_id)


def test_a_disk_that_refuses_answers_unavailable_and_keeps_what_was_acknowledged(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path, max_file_bytes=20_000) as full:
        create_map(full.await_ready().http, "lab")
        kept = 0
        while (response := put_scan(full.http, "lab", *scan_frame(some_points(kept)))).status_code == 201:
            kept += 1
        assert_problem(response, 503, "unavailable")
        assert response.headers["retry-after"]
        assert kept > 1
        leaves = served_leaves(full.http, "lab")
        small = put_scan(full.http, "lab", *scan_frame(some_points(99, count=2)))
        assert small.status_code in (201, 503)
        leaves = served_leaves(full.http, "lab") if small.status_code == 201 else leaves
        full.kill()
    with ServiceProcess(tmp_path) as again:
        info = again.await_ready().http.get("/v1/maps/lab").json()
        assert info["scans_acknowledged"] == kept + (small.status_code == 201)
        assert info["journal_cut"] is None
        assert served_leaves(again.http, "lab") == leaves
