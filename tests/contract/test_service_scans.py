from __future__ import annotations

import json
import math
import uuid
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from rayvox import MapSnapshot, OccupancyMap
from rayvox_service.frame import encode_frame

from tests.support.point_files import ascii_pcd, ascii_ply
from tests.support.service_process import (
    FRAME_HEADERS,
    ServiceProcess,
    as_frame,
    assert_problem,
    create_map,
    leaf_dict,
    put_scan,
    scan_frame,
    served_leaves,
    some_points,
)

POSE = np.array([[0.0, -1.0, 0.0, 3.0], [1.0, 0.0, 0.0, -2.0], [0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 1.0]])


def kernel_map(*scans: dict[str, Any]) -> OccupancyMap:
    occupancy_map = OccupancyMap(0.25)
    for scan in scans:
        occupancy_map.insert_scan(**scan)
    return occupancy_map


def kernel_leaves(*scans: dict[str, Any]) -> dict[tuple[int, ...], float]:
    return leaf_dict(*kernel_map(*scans).leaves())


def test_a_scan_with_every_field_gives_the_kernels_map(service: ServiceProcess, lab: str) -> None:
    scan_id = uuid.uuid4()
    no_return = np.array([[0.0, 8.0, 0.0], [0.0, 0.0, 3.0]])
    fields = {"T_map_sensor": POSE.ravel().tolist(), "origin": [0.1, 0.2, 0.3], "max_range_m": 4.0}
    arrays: dict[str, npt.NDArray[Any]] = {"points": some_points(), "no_return": no_return}
    data = encode_frame("scan", {"scan_id": str(scan_id), **fields, "discretize": True, "stamp_s": 1.5}, arrays)
    response = put_scan(service.http, lab, scan_id, data)
    assert response.status_code == 201
    receipt = response.json()
    assert receipt["statistics"]["ray_count"] > 0
    assert {name: receipt[name] for name in ("scan_id", "sequence", "status", "revision", "duplicate")} == {
        "scan_id": str(scan_id),
        "sequence": 1,
        "status": "applied",
        "revision": 1,
        "duplicate": False,
    }
    assert served_leaves(service.http, lab) == kernel_leaves(
        {
            "points": some_points(),
            "T_map_sensor": POSE,
            "origin": (0.1, 0.2, 0.3),
            "max_range_m": 4.0,
            "no_return": no_return,
            "discretize": True,
        }
    )


def test_a_compressed_scan_gives_the_same_map_as_a_raw_one(service: ServiceProcess, lab: str) -> None:
    put_scan(service.http, lab, *scan_frame(some_points(), zstd=True))
    assert served_leaves(service.http, lab) == kernel_leaves({"points": some_points()})


def test_integer_points_are_scaled_to_metres(service: ServiceProcess, lab: str) -> None:
    millimetres = (some_points() * 1000).astype("<i2")
    put_scan(service.http, lab, *scan_frame(millimetres, scale_m=0.001))
    assert served_leaves(service.http, lab) == kernel_leaves({"points": millimetres * 0.001})


def test_a_depth_image_is_projected_through_its_pinhole(service: ServiceProcess, lab: str) -> None:
    depth = np.array([[0, 1000, 2000], [3000, 0, 4000]], "<u2")
    intrinsics = {"fx": 2.0, "fy": 4.0, "cx": 1.0, "cy": 0.5, "depth_scale_m": 0.001}
    scan_id = uuid.uuid4()
    data = encode_frame("scan", {"scan_id": str(scan_id), "intrinsics": intrinsics}, {"depth": depth})
    assert put_scan(service.http, lab, scan_id, data).status_code == 201
    points = [((u - 1.0) * z / 2.0, (v - 0.5) * z / 4.0, z) for v, u, z in [(0, 1, 1), (0, 2, 2), (1, 0, 3), (1, 2, 4)]]
    assert served_leaves(service.http, lab) == kernel_leaves({"points": np.array(points)})


@pytest.mark.parametrize(
    "intrinsics", [None, {}, {"fx": 1.0}, {"fx": 0.0, "fy": 1, "cx": 0, "cy": 0, "depth_scale_m": 1}]
)
def test_a_depth_image_without_usable_intrinsics_is_refused(
    service: ServiceProcess, lab: str, intrinsics: object
) -> None:
    scan_id = uuid.uuid4()
    data = encode_frame("scan", {"scan_id": str(scan_id), "intrinsics": intrinsics}, {"depth": np.ones((2, 2), "<u2")})
    assert_problem(put_scan(service.http, lab, scan_id, data), 422, "invalid-input")


@pytest.mark.parametrize(("media", "write"), [("application/vnd.pcd", ascii_pcd), ("model/vnd.ply", ascii_ply)])
def test_a_point_cloud_file_is_taken_with_its_pose_in_the_address(
    service: ServiceProcess, lab: str, media: str, write: Any
) -> None:
    points = np.round(some_points(count=20), 2)
    pose = ",".join(map(str, POSE.ravel()))
    url = f"/v1/maps/{lab}/scans/{uuid.uuid4()}?wait=applied&T_map_sensor={pose}&max_range_m=4"
    answers = [service.http.put(url, content=write(points), headers={"Content-Type": media}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [201, 200]
    assert served_leaves(service.http, lab) == kernel_leaves(
        {"points": points, "T_map_sensor": POSE, "max_range_m": 4.0}
    )


@pytest.mark.parametrize(
    ("body", "query"),
    [
        (b"no cloud", ""),
        (ascii_pcd(some_points(count=3)).replace(b"POINTS 3", b"POINTS 1000000000"), ""),
        (ascii_pcd(some_points(count=3)), "&T_map_sensor=1,2,3"),
        (ascii_pcd(some_points(count=3)), "&max_range_m=far"),
    ],
)
def test_a_point_cloud_file_that_lies_is_refused(service: ServiceProcess, lab: str, body: bytes, query: str) -> None:
    url = f"/v1/maps/{lab}/scans/{uuid.uuid4()}?wait=applied{query}"
    response = service.http.put(url, content=body, headers={"Content-Type": "application/vnd.pcd"})
    assert_problem(response, 422, "invalid-input")
    assert service.http.get(f"/v1/maps/{lab}").json()["last_sequence"] == 0


@pytest.mark.parametrize("wait", ["journaled", "applied"])
def test_a_scan_sent_twice_is_there_once(service: ServiceProcess, lab: str, wait: str) -> None:
    scan_id, data = scan_frame(some_points())
    answers = [put_scan(service.http, lab, scan_id, data, wait=wait) for _ in range(3)]
    assert [answer.status_code for answer in answers] == [201, 200, 200]
    assert [answer.json()["duplicate"] for answer in answers] == [False, True, True]
    assert {answer.json()["sequence"] for answer in answers} == {1}
    put_scan(service.http, lab, *scan_frame(some_points(2)))
    assert served_leaves(service.http, lab) == kernel_leaves({"points": some_points()}, {"points": some_points(2)})


@pytest.fixture
def filled(service: ServiceProcess, lab: str) -> tuple[str, MapSnapshot]:
    """A map with one scan, and the kernel's own."""
    put_scan(service.http, lab, *scan_frame(some_points()))
    return lab, kernel_map({"points": some_points()}).snapshot()


def query_points() -> npt.NDArray[np.float64]:
    """Places all around the scan, and its own end points."""
    return np.vstack([np.random.default_rng(5).uniform(-7, 7, (300, 3)), some_points()])


@pytest.mark.parametrize("depth", [None, 14])
def test_points_are_answered_as_the_kernel_does_in_both_forms(
    service: ServiceProcess, filled: tuple[str, MapSnapshot], depth: int | None
) -> None:
    lab, snapshot = filled
    points = query_points()
    states, log_odds = snapshot.states_at(points, depth), snapshot.log_odds_at(points, depth)
    assert set(states.tolist()) == {0, 1, 2}
    asked = {} if depth is None else {"depth": depth}
    answer = service.http.post(f"/v1/maps/{lab}/points", json={"points": points.tolist(), **asked}).json()
    assert answer["states"] == states.tolist()
    assert answer["revision"] == 1
    assert answer["log_odds"] == [None if math.isnan(value) else value for value in log_odds.tolist()]
    data = encode_frame("points", asked, {"points": points})
    frame = as_frame(service.http.post(f"/v1/maps/{lab}/points", content=data, headers=FRAME_HEADERS))
    assert frame.kind == "occupancy"
    assert frame.fields == {"revision": 1}
    assert np.array_equal(frame.array("states"), states)
    assert np.array_equal(frame.array("log_odds"), log_odds, equal_nan=True)


def test_boxes_are_answered_as_the_kernel_does_in_both_forms(
    service: ServiceProcess, filled: tuple[str, MapSnapshot]
) -> None:
    lab, snapshot = filled
    lo = query_points()
    hi = lo + np.random.default_rng(6).uniform(0, 1, lo.shape)
    states = snapshot.box_states(lo, hi)
    answer = service.http.post(f"/v1/maps/{lab}/boxes", json={"lo": lo.tolist(), "hi": hi.tolist()}).json()
    assert answer == {"revision": 1, "states": states.tolist()}
    data = encode_frame("boxes", {}, {"lo": lo, "hi": hi})
    frame = as_frame(service.http.post(f"/v1/maps/{lab}/boxes", content=data, headers=FRAME_HEADERS))
    assert frame.kind == "occupancy"
    assert np.array_equal(frame.array("states"), states)


@pytest.mark.parametrize("unknown", ["free", "occupied"])
def test_rays_are_answered_as_the_kernel_does_in_both_forms(
    service: ServiceProcess, filled: tuple[str, MapSnapshot], unknown: Any
) -> None:
    lab, snapshot = filled
    directions = np.random.default_rng(7).normal(size=(100, 3))
    origins = np.zeros((100, 3))
    hits = snapshot.cast_rays(origins, directions, 6.0, unknown)
    query = {"origins": origins.tolist(), "directions": directions.tolist(), "max_range_m": 6.0, "unknown": unknown}
    answer = service.http.post(f"/v1/maps/{lab}/rays", json=query).json()
    assert answer["hit"] == hits.hit.tolist()
    assert answer["voxel"] == hits.voxel.tolist()
    assert answer["t_m"] == hits.t_m.tolist()
    data = encode_frame(
        "rays", {"max_range_m": 6.0, "unknown": unknown}, {"origins": origins, "directions": directions.astype("<f4")}
    )
    frame = as_frame(service.http.post(f"/v1/maps/{lab}/rays", content=data, headers=FRAME_HEADERS))
    assert frame.kind == "hits"
    assert (frame.array("hit").dtype.str, frame.array("t_m").dtype.str, frame.array("voxel").dtype.str) == (
        "|u1",
        "<f8",
        "<i8",
    )
    narrow = snapshot.cast_rays(origins, directions.astype("<f4"), 6.0, unknown)
    assert np.array_equal(frame.array("voxel"), narrow.voxel)


def test_a_query_waits_for_the_revision_it_needs(service: ServiceProcess, lab: str) -> None:
    scans = [scan_frame(some_points(seed)) for seed in range(5)]
    for scan_id, data in scans:
        put_scan(service.http, lab, scan_id, data, wait="journaled")
    url = f"/v1/maps/{lab}/points?min_revision=5"
    assert service.http.post(url, json={"points": [[0, 0, 0]]}).json()["revision"] >= 5


def test_a_cleared_box_is_unknown_again_and_stays_so_in_the_journal(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path) as service:
        create_map(service.await_ready().http, "lab")
        put_scan(service.http, "lab", *scan_frame(some_points()))
        answer = service.http.post("/v1/maps/lab/clear", json={"lo": [-2, -2, -2], "hi": [2, 2, 2]}).json()
        assert answer == {"revision": 2, "sequence": 2}
        leaves = served_leaves(service.http, "lab")
        service.kill()
    occupancy_map = kernel_map({"points": some_points()})
    occupancy_map.clear_box((-2, -2, -2), (2, 2, 2))
    assert leaves == leaf_dict(*occupancy_map.leaves())
    with ServiceProcess(tmp_path) as service:
        assert served_leaves(service.await_ready().http, "lab") == leaves


def test_changes_name_the_revisions_they_lead_between(service: ServiceProcess, lab: str) -> None:
    for seed in range(3):
        put_scan(service.http, lab, *scan_frame(some_points(seed)))
    frame = as_frame(service.http.get(f"/v1/maps/{lab}/changes?since=2"))
    fields = {name: frame.fields[name] for name in ("since", "revision", "resolution_m", "depth")}
    assert frame.kind == "changes"
    assert fields == {"since": 2, "revision": 3, "resolution_m": 0.25, "depth": 16}
    assert {name: frame.array(name).dtype.str for name in frame.payloads} == {
        "region_keys": "<i4",
        "region_depth": "|u1",
        "keys": "<i4",
        "leaf_depth": "|u1",
        "log_odds": "<f4",
    }
    ahead = as_frame(service.http.get(f"/v1/maps/{lab}/changes?since=99"))
    assert ahead.fields["full"] is True
    assert ahead.fields["revision"] == 3


@pytest.mark.parametrize("format", ["bt", "ot", "ply"])
def test_an_export_is_the_kernels_file(service: ServiceProcess, filled: tuple[str, MapSnapshot], format: Any) -> None:
    lab, snapshot = filled
    response = service.http.get(f"/v1/maps/{lab}/export?format={format}")
    assert response.content == snapshot.export_bytes(format)
    assert response.headers["content-disposition"] == f'attachment; filename="{lab}.{format}"'
    assert response.headers["rayvox-revision"] == "1"


def test_a_maps_info_says_what_it_is_and_how_far_it_got(service: ServiceProcess) -> None:
    model = {"p_hit": 0.8, "p_miss": 0.3, "p_clamp_min": 0.1, "p_clamp_max": 0.95, "p_occupied": 0.6}
    body = {"name": "Own.model-1_x", "resolution_m": 0.5, "depth": 18, "sensor_model": model}
    created = service.http.post("/v1/maps", json=body)
    assert created.status_code == 201
    assert created.headers["location"] == "/v1/maps/Own.model-1_x"
    info = created.json()
    assert {name: info[name] for name in body} == body
    assert info["state"] == "open"
    assert info["revision"] == 0
    put_scan(service.http, "Own.model-1_x", *scan_frame(some_points()))
    info = service.http.get("/v1/maps/Own.model-1_x?statistics=true").json()
    numbers = ("revision", "scans_acknowledged", "scans_applied", "last_sequence", "applied_sequence", "queue_bytes")
    assert [info[name] for name in numbers] == [1, 1, 1, 1, 1, 0]
    assert info["statistics"]["occupied_leaves"] > 0
    assert info["memory_bytes"] > 0
    listed = service.http.get("/v1/maps").json()["maps"]
    assert next(entry for entry in listed if entry["name"] == "Own.model-1_x")["last_sequence"] == 1


def test_a_deleted_map_is_gone_and_its_name_is_free(service: ServiceProcess, lab: str) -> None:
    scan_id, data = scan_frame(some_points())
    put_scan(service.http, lab, scan_id, data)
    assert service.http.delete(f"/v1/maps/{lab}").status_code == 204
    assert_problem(service.http.get(f"/v1/maps/{lab}"), 404, "map-not-found")
    assert_problem(service.http.delete(f"/v1/maps/{lab}"), 404, "map-not-found")
    assert create_map(service.http, lab)["scans_acknowledged"] == 0
    assert put_scan(service.http, lab, scan_id, data).status_code == 201


def test_the_version_and_health_are_told(service: ServiceProcess) -> None:
    assert service.http.get("/v1/health").json() == {"status": "ok"}
    assert service.http.get("/v1/ready").status_code == 200
    version = service.http.get("/v1/version").json()
    assert version["api"] == "v1"
    assert version["service"]
    assert version["kernel"]


def test_everything_but_health_needs_the_key_where_there_is_one(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path, api_key="open sesame") as guarded:
        assert guarded.http.get("/v1/health").status_code == 200
        assert guarded.http.get("/v1/ready").status_code in (200, 503)
        for header in ({}, {"Authorization": "Bearer wrong"}, {"Authorization": "open sesame"}):
            response = guarded.http.get("/v1/maps", headers=header)
            assert_problem(response, 401, "unauthorized")
            assert response.headers["www-authenticate"] == "Bearer"
            assert_problem(guarded.http.get("/nothing", headers=header), 401, "unauthorized")
        allowed = guarded.http.get("/v1/maps", headers={"Authorization": "Bearer open sesame"})
        assert allowed.json() == {"maps": []}


def test_a_stopped_service_leaves_a_map_that_starts_again(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path) as service:
        create_map(service.await_ready().http, "lab")
        for seed in range(5):
            put_scan(service.http, "lab", *scan_frame(some_points(seed)), wait="journaled")
    with ServiceProcess(tmp_path) as service:
        info = service.await_ready().http.get("/v1/maps/lab").json()
        assert info["scans_applied"] == info["scans_acknowledged"] == 5
        assert info["journal_cut"] is None
        assert served_leaves(service.http, "lab") == kernel_leaves(*({"points": some_points(s)} for s in range(5)))


def test_a_damaged_map_answers_unavailable_and_leaves_the_others_alone(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path) as service:
        for name in ("good", "bad"):
            create_map(service.await_ready().http, name)
            put_scan(service.http, name, *scan_frame(some_points()))
    (tmp_path / "maps" / "bad" / "map.json").write_text("{}")
    with ServiceProcess(tmp_path) as service:
        response = service.await_ready().http.get("/v1/maps/bad")
        assert_problem(response, 503, "unavailable")
        assert served_leaves(service.http, "good") == kernel_leaves({"points": some_points()})
        listed = {entry["name"]: entry["state"] for entry in service.http.get("/v1/maps").json()["maps"]}
        assert listed == {"good": "open", "bad": "failed"}
        assert_problem(service.http.post("/v1/maps", json={"name": "bad", "resolution_m": 1}), 409, "map-exists")
        assert service.http.delete("/v1/maps/bad").status_code == 204
        create_map(service.http, "bad")


def test_half_created_and_half_deleted_maps_are_swept_away(tmp_path: Path) -> None:
    for folder in ("staging", "trash"):
        (tmp_path / folder / "leftover").mkdir(parents=True)
        (tmp_path / folder / "leftover" / "map.json").write_text("{")
    with ServiceProcess(tmp_path) as service:
        assert service.await_ready().http.get("/v1/maps").json() == {"maps": []}
        assert not any((tmp_path / "staging").iterdir())
        assert not any((tmp_path / "trash").iterdir())


def test_large_answers_come_whole(service: ServiceProcess, lab: str) -> None:
    points = np.random.default_rng(1).uniform(-20, 20, (50_000, 3))
    data = encode_frame("points", {}, {"points": points})
    frame = as_frame(service.http.post(f"/v1/maps/{lab}/points", content=data, headers=FRAME_HEADERS))
    assert frame.array("states").shape == (50_000,)
    assert json.dumps(frame.fields)
