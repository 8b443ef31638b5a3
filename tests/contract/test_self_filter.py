"""A robot that sees itself: over a real socket, the map must be the one of the scan without the robot."""

from __future__ import annotations

import itertools
import json
import uuid
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray
from rayvox_client import (
    AttachedObject,
    Client,
    Intrinsics,
    InvalidInputError,
    RefusedInputError,
    RobotNotFoundError,
    Scan,
    ScanConflictError,
    SelfFilter,
)

from tests.support.arm_in_room import ARM
from tests.support.point_files import ascii_ply
from tests.support.robots import arm_archive
from tests.support.service_process import ServiceProcess, assert_problem, served_leaves

Q = ARM.configuration({"slide": 0.1, "shoulder": 0.4, "elbow": 1.0, "finger_l": 0.02})
MOUNTED = np.array([[0.0, 0, 1, 0.06], [-1, 0, 0, 0.0], [0, -1, 0, 0.3], [0, 0, 0, 1]])  # on "column", looking along x
PADDING_M = 0.02
_numbers = itertools.count()


def sensor_pose() -> NDArray[np.float64]:
    base: NDArray[np.float64] = ARM.link_poses(Q)[0, ARM.link_index("column")] @ MOUNTED
    return base


def rays(count: int = 4000) -> NDArray[np.float64]:
    """Ends in the sensor's frame, a good part of them on the arm or behind it."""
    rng = np.random.default_rng(7)
    ends = rng.uniform([-1, -1, 0.05], [1, 1, 2.5], (count, 3))
    ends[::2] *= rng.uniform(0.05, 0.5, (len(ends[::2]), 1))
    return np.asarray(ends)


def kept(points: NDArray[Any], padding_m: float = PADDING_M) -> NDArray[np.bool_]:
    kinds = rayvox.BodyFilter(ARM).classify(points, Q, sensor_pose(), padding_m=padding_m)
    assert set(kinds) == {0, 1, 2}
    return np.equal(kinds, rayvox.ScanPoint.KEPT)


def leaves_of(local: rayvox.OccupancyMap) -> dict[tuple[int, ...], float]:
    keys, depth, log_odds = local.leaves()
    return {(*key, d): o for key, d, o in zip(keys.tolist(), depth.tolist(), log_odds.tolist(), strict=True)}


def wanted_leaves(points: NDArray[Any], T_map_sensor: NDArray[np.float64], **options: Any) -> Any:
    local = rayvox.OccupancyMap(0.05)
    local.insert_scan(points, T_map_sensor, **options)
    return leaves_of(local)


def filter_by_link(robot: str, **changed: Any) -> SelfFilter:
    options = {"sensor_link": "column", "T_link_sensor": MOUNTED, "padding_m": PADDING_M, **changed}
    return SelfFilter(robot, Q, **options)


def test_the_map_is_that_of_the_points_which_are_not_the_robot(
    service: ServiceProcess, client: Client, robot: str
) -> None:
    points, T_map_base = rays(), np.eye(4)
    T_map_base[:3, 3] = 1.0, 2.0, 0.3
    T_map_sensor = T_map_base @ sensor_pose()
    free = 1.2 * points[:1500]
    for how in (filter_by_link(robot), SelfFilter(robot, Q, T_map_base=T_map_base, padding_m=PADDING_M)):
        name = f"self-{next(_numbers)}"
        client.create_map(name, resolution_m=0.05)
        receipt = client.insert_scan(name, points, T_map_sensor, no_return=free, self_filter=how)
        left, left_free = points[kept(points)], free[kept(free)]
        assert served_leaves(service.http, name) == wanted_leaves(left, T_map_sensor, no_return=left_free)
        assert receipt.statistics is not None
        dropped = int(receipt.statistics["points_on_body"]) + int(receipt.statistics["points_behind_body"])  # type: ignore[call-overload]
        assert dropped == len(points) + len(free) - len(left) - len(left_free)
        assert receipt.statistics["ray_count"] == len(left) + len(left_free)


def test_pixels_on_the_robot_count_as_not_measured(service: ServiceProcess, client: Client, robot: str) -> None:
    depth = np.full((40, 60), 900, np.uint16)
    depth[:10] = 0
    depth[20:, 10:50] = 450
    camera = Intrinsics(40.0, 40.0, 30.0, 20.0, 0.001)
    client.create_map("self-depth", resolution_m=0.05)
    client.insert_depth_image("self-depth", depth, camera, sensor_pose(), self_filter=filter_by_link(robot))
    from rayvox.scan_io import DepthIntrinsics, depth_to_points

    points = depth_to_points(depth, DepthIntrinsics(40.0, 40.0, 30.0, 20.0, 0.001))
    left = points[rayvox.BodyFilter(ARM).classify(points, Q, sensor_pose(), padding_m=PADDING_M) == 0]
    assert 0 < len(left) < len(points)
    assert served_leaves(service.http, "self-depth") == wanted_leaves(left, sensor_pose())


def test_a_point_cloud_file_is_filtered_by_the_address(service: ServiceProcess, client: Client, robot: str) -> None:
    points = np.round(rays(500), 3)
    client.create_map("self-file", resolution_m=0.05)
    parameters = {"wait": "applied", "T_map_sensor": ",".join(map(str, sensor_pose().ravel()))}
    url, headers = f"/v1/maps/self-file/scans/{uuid.uuid4()}", {"Content-Type": "model/vnd.ply"}
    wrong = service.http.put(
        url, params=parameters | {"self_filter": '{"robot": 3}'}, content=ascii_ply(points), headers=headers
    )
    assert_problem(wrong, 422, "invalid-input")
    asked = json.dumps(filter_by_link(robot).to_json())
    answer = service.http.put(
        url, params=parameters | {"self_filter": asked}, content=ascii_ply(points), headers=headers
    )
    assert answer.status_code == 201, answer.text
    assert served_leaves(service.http, "self-file") == wanted_leaves(
        points[kept(points.astype(np.float32))], sensor_pose()
    )


def test_padding_by_link_and_what_the_robot_holds_are_filtered_too(
    service: ServiceProcess, client: Client, robot: str
) -> None:
    points = rays()
    held = AttachedObject("hand", np.eye(4), box=(0.3, 0.3, 0.3))
    client.create_map("self-holding", resolution_m=0.05)
    asked = filter_by_link(robot, padding_m={"upper": 0.1}, attached=[held])
    client.insert_scan("self-holding", points, sensor_pose(), self_filter=asked)
    from rayvox.robot.primitives import box_mesh

    holding = ARM.with_attached("attached", box_mesh((0.3, 0.3, 0.3)), "hand")
    kinds = rayvox.BodyFilter(holding).classify(points, Q, sensor_pose(), padding_m={"upper": 0.1})
    assert served_leaves(service.http, "self-holding") == wanted_leaves(points[kinds == 0], sensor_pose())


def test_sending_a_filtered_scan_again_is_harmless_and_other_bytes_are_a_conflict(client: Client, robot: str) -> None:
    client.create_map("self-again", resolution_m=0.05)
    scan = Scan(rays(), sensor_pose(), self_filter=filter_by_link(robot), scan_id=uuid.uuid4())
    first, again = client.insert("self-again", scan), client.insert("self-again", scan)
    assert (first.duplicate, again.duplicate, again.sequence) == (False, True, first.sequence)
    other = Scan(rays(), sensor_pose(), scan_id=scan.scan_id)
    with pytest.raises(ScanConflictError):
        client.insert("self-again", other)


def test_a_restart_gives_the_same_map_though_the_robot_is_gone(tmp_path: Path) -> None:
    scan = Scan(rays(), sensor_pose(), self_filter=filter_by_link("arm"), scan_id=uuid.uuid4())
    with ServiceProcess(tmp_path) as running:
        client = Client(running.url)
        content = {"content": arm_archive(), "headers": {"content-type": "application/zip"}}
        running.await_ready().http.put("/v1/robots/arm", **content)
        client.create_map("lab", resolution_m=0.05)
        with client.stream("lab") as stream:
            stream.push_scan(scan)
        client.wait_applied("lab")
        before = served_leaves(running.http, "lab")
        client.delete_robot("arm")
        running.kill()
    with ServiceProcess(tmp_path) as running:
        assert served_leaves(running.await_ready().http, "lab") == before
        again = Client(running.url).insert("lab", scan)
        assert again.duplicate


def test_a_filter_that_cannot_be_used_is_refused_and_changes_nothing(client: Client, robot: str) -> None:
    client.create_map("self-wrong", resolution_m=0.05)
    with pytest.raises(RobotNotFoundError):
        client.insert_scan("self-wrong", rays(), self_filter=SelfFilter("nobody", Q))
    for wrong in (SelfFilter(robot, Q[:2]), SelfFilter(robot, Q, sensor_link="tail"), SelfFilter(robot)):
        with pytest.raises(RefusedInputError):
            client.insert_scan("self-wrong", rays(), self_filter=wrong)
    with pytest.raises(RefusedInputError, match="nothing but the robot"):
        client.insert_scan("self-wrong", [[0.01, 0, 0.01]], np.eye(4), self_filter=SelfFilter(robot, Q))
    with pytest.raises(InvalidInputError):
        SelfFilter(robot, Q, T_map_base=np.eye(4), sensor_link="column")
    assert client.map_info("self-wrong").last_sequence == 0
