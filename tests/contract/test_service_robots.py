"""Robots over HTTP: uploaded, listed, kept over restarts, refused."""

from __future__ import annotations

import asyncio
import itertools
import json
import re
import threading
import time
from pathlib import Path

import httpx
import numpy as np
import pytest
import rayvox
from rayvox_client import (
    AsyncClient,
    Client,
    InvalidInputError,
    RefusedInputError,
    RobotExistsError,
    RobotNotFoundError,
    TooLargeError,
)

from tests.support.datasets import data_path
from tests.support.mesh_files import cube_files
from tests.support.robots import ARM_URDF, CUBE_STL, arm_archive, one_link, zipped
from tests.support.service_process import ServiceProcess, assert_problem

ZIP, STL = {"content-type": "application/zip"}, {"content-type": "model/stl"}
TYPES = {
    "stl": "model/stl",
    "obj": "model/obj",
    "ply": "model/vnd.ply",
    "off": "model/off",
    "dae": "model/vnd.collada+xml",
    "glb": "model/gltf-binary",
}
_numbers = itertools.count()


@pytest.fixture
def name() -> str:
    return f"robot-{next(_numbers)}"


def put(http: httpx.Client, name: str, data: bytes, headers: dict[str, str] = ZIP, **query: str) -> httpx.Response:
    return http.put(f"/v1/robots/{name}", content=data, headers=headers, params=query)


def test_an_uploaded_robot_is_described_listed_and_deleted(service: ServiceProcess, name: str) -> None:
    created = put(service.http, name, arm_archive())
    assert created.status_code == 201, created.text
    assert created.headers["location"] == f"/v1/robots/{name}"
    info = service.http.get(f"/v1/robots/{name}").json()
    assert info == created.json()
    assert info["joints"] == ["turn", "slide", "shoulder", "elbow", "finger_l"]
    assert (info["lower"][0], info["upper"][1]) == (None, 0.3)
    assert ["left", "right"] not in info["allowed_collisions"]
    assert ["base", "column"] in info["allowed_collisions"]
    assert {link["name"]: link["closed"] for link in info["links"]}["lift"]
    listed = {robot["name"]: robot for robot in service.http.get("/v1/robots").json()["robots"]}
    assert (listed[name]["state"], listed[name]["links"]) == ("ready", 8)
    assert service.http.delete(f"/v1/robots/{name}").status_code == 204
    assert_problem(service.http.get(f"/v1/robots/{name}"), 404, "robot-not-found")
    assert_problem(service.http.delete(f"/v1/robots/{name}"), 404, "robot-not-found")


@pytest.mark.parametrize("kind", cube_files())
def test_every_mesh_format_is_a_rigid_robot(service: ServiceProcess, name: str, kind: str) -> None:
    file_format, data = cube_files()[kind]
    answer = put(service.http, name, data, {"content-type": TYPES[file_format]}, scale="0.5")
    assert answer.status_code == 201, answer.text
    assert (answer.json()["triangles"], answer.json()["joints"], answer.json()["scale"]) == (12, [], 0.5)


def test_the_same_upload_again_changes_nothing_and_another_is_a_conflict(service: ServiceProcess, name: str) -> None:
    assert put(service.http, name, CUBE_STL, STL).status_code == 201
    assert put(service.http, name, CUBE_STL, STL).status_code == 200
    assert_problem(put(service.http, name, CUBE_STL, STL, scale="2"), 409, "robot-exists")
    assert_problem(put(service.http, name, arm_archive()), 409, "robot-exists")
    service.http.delete(f"/v1/robots/{name}")
    assert put(service.http, name, arm_archive()).status_code == 201


@pytest.mark.parametrize(
    ("data", "headers", "query", "status", "slug", "says"),
    [
        (b"", ZIP, {}, 422, "invalid-input", "not a zip"),
        (b"", STL, {}, 422, "invalid-input", "STL"),
        (CUBE_STL[:-1], STL, {}, 422, "invalid-input", "12 triangles does not fit"),
        (zipped({"a.urdf": one_link("<sdf/>")}), ZIP, {}, 422, "invalid-input", "none of mesh"),
        (zipped({"a.urdf": one_link('<mesh filename="/etc/passwd"/>')}), ZIP, {}, 422, "invalid-input", "relative"),
        (zipped({"a.xacro": b""}), ZIP, {}, 422, "invalid-input", "xacro is not supported"),
        (arm_archive(), ZIP, {"description": "b.urdf"}, 422, "invalid-input", "arm/urdf/arm.urdf"),
        (arm_archive(), ZIP, {"geometry": "both"}, 422, "invalid-input", "geometry"),
        (CUBE_STL, STL, {"scale": "-1"}, 422, "invalid-input", "scale"),
        (CUBE_STL, STL, {"scale": "nan"}, 422, "invalid-input", "scale"),
        (CUBE_STL, {"content-type": "text/plain"}, {}, 415, "unsupported-media-type", "model/stl"),
    ],
)
def test_uploads_that_cannot_be_right_are_refused(
    service: ServiceProcess,
    name: str,
    data: bytes,
    headers: dict[str, str],
    query: dict[str, str],
    status: int,
    slug: str,
    says: str,
) -> None:
    assert says in assert_problem(put(service.http, name, data, headers, **query), status, slug)["detail"]
    assert_problem(service.http.get(f"/v1/robots/{name}"), 404, "robot-not-found")


@pytest.mark.parametrize("bad", [".hidden", "-x", "a b", "ä", "x" * 65, "%2e%2e", "..%2fmaps"])
def test_names_that_could_leave_the_data_directory_are_refused(service: ServiceProcess, bad: str) -> None:
    for method in ("PUT", "GET", "DELETE"):
        request = httpx.Request(method, f"{service.url}/v1/robots/{bad}", content=CUBE_STL, headers=STL)
        response = service.http.send(request)
        assert response.status_code in (404, 422), response.text
        assert response.headers["content-type"] == "application/problem+json"


def test_robots_outlive_the_service(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path) as first:
        first.await_ready()
        before = put(first.http, "arm", arm_archive()).json()
        put(first.http, "cube", CUBE_STL, STL)
        put(first.http, "gone", CUBE_STL, STL)
        first.http.delete("/v1/robots/gone")
        first.kill()
    # What was on its way when the service died is not there, and what was damaged says so.
    (tmp_path / "robots" / ".half").mkdir()
    with (tmp_path / "robots" / "cube" / "content").open("r+b") as content:
        content.write(b"x")
    with ServiceProcess(tmp_path) as second:
        second.await_ready()
        assert second.http.get("/v1/robots/arm").json() == before
        assert_problem(second.http.get("/v1/robots/cube"), 503, "unavailable")
        assert_problem(put(second.http, "cube", CUBE_STL, STL), 503, "unavailable")
        states = {robot["name"]: robot["state"] for robot in second.http.get("/v1/robots").json()["robots"]}
        assert states == {"arm": "ready", "cube": "failed"}
        assert second.http.delete("/v1/robots/cube").status_code == 204
        assert put(second.http, "cube", CUBE_STL, STL).status_code == 201
        assert not (tmp_path / "robots" / ".half").exists()


def test_limits_of_robots_are_settings(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path, max_robot_triangles=100, max_robot_expanded_bytes=1 << 20) as service:
        service.await_ready()
        assert put(service.http, "cube", CUBE_STL, STL).status_code == 201
        assert_problem(put(service.http, "arm", arm_archive()), 413, "too-large")
        bomb = zipped({"a.urdf": one_link('<mesh filename="b.stl"/>'), "b.stl": bytes(1 << 24)})
        assert_problem(put(service.http, "bomb", bomb), 413, "too-large")
    with ServiceProcess(tmp_path / "slow", max_robot_parse_s=1e-9) as service:
        service.await_ready()
        assert_problem(put(service.http, "cube", CUBE_STL, STL), 413, "too-large")


def test_a_full_disk_leaves_no_half_robot(tmp_path: Path) -> None:
    large = np.random.default_rng(0).bytes(200_000)
    with ServiceProcess(tmp_path, max_file_bytes=100_000) as service:
        service.await_ready()
        archive = zipped({"a.urdf": one_link('<box size="1 1 1"/>'), "noise.bin": large})
        assert_problem(put(service.http, "large", archive), 503, "unavailable")
        assert_problem(service.http.get("/v1/robots/large"), 404, "robot-not-found")
        assert not any((tmp_path / "robots").iterdir())


def test_other_requests_are_answered_while_a_robot_is_read(service: ServiceProcess, name: str) -> None:
    vertices = "\n".join(f"v {i % 1000} {i // 1000} {i % 7}" for i in range(200_000))
    faces = "\n".join(f"f {i + 1} {i + 2} {i + 1001}" for i in range(190_000))
    data = f"{vertices}\n{faces}\n".encode()
    done = threading.Event()

    def upload() -> None:
        with httpx.Client(base_url=service.url, timeout=60) as http:
            assert put(http, name, data, {"content-type": "model/obj"}).status_code == 201
        done.set()

    uploading = threading.Thread(target=upload)
    uploading.start()
    answered = 0
    while not done.is_set():
        assert service.http.get("/v1/health").status_code == 200
        answered += 1
        time.sleep(0.001)
    uploading.join()
    assert answered >= 10
    service.http.delete(f"/v1/robots/{name}")


@pytest.fixture
def arm_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "my arm"
    (folder / "meshes").mkdir(parents=True)
    (folder / "arm.urdf").write_text(ARM_URDF)
    (folder / "meshes" / "cube.stl").write_bytes(CUBE_STL)
    (folder / "notes.txt").write_text("not for the service")
    return folder


def test_the_client_uploads_folders_descriptions_archives_and_meshes(service: ServiceProcess, arm_folder: Path) -> None:
    archive, mesh = arm_folder / "packed.zip", arm_folder / "meshes" / "cube.stl"
    archive.write_bytes(arm_archive())
    with Client(service.url) as client:
        whole = client.upload_robot(arm_folder)
        assert (whole.name, whole.joint_names[1], whole.lower[1], whole.upper[0]) == ("my_arm", "slide", -0.2, np.inf)
        assert client.upload_robot(arm_folder) == whole
        by_description = client.upload_robot(arm_folder / "arm.urdf", "by-description")
        by_archive = client.upload_robot(archive)
        assert whole.links == by_description.links == by_archive.links
        assert client.upload_robot(mesh, scale=0.001).joint_names == ()
        names = {"my_arm", "by-description", "packed", "cube"}
        assert names <= {robot.name for robot in client.list_robots()}
        assert client.robot_info("my_arm") == whole
        for name in names:
            client.delete_robot(name)
        assert not names & {robot.name for robot in client.list_robots()}


def test_the_clients_errors_are_typed(service: ServiceProcess, arm_folder: Path, name: str) -> None:
    with Client(service.url) as client:
        with pytest.raises(RobotNotFoundError):
            client.robot_info(name)
        with pytest.raises(RobotNotFoundError):
            client.delete_robot(name)
        client.upload_robot(arm_folder, name)
        with pytest.raises(RobotExistsError):
            client.upload_robot(arm_folder / "meshes" / "cube.stl", name)
        with pytest.raises(InvalidInputError, match=r"ends in \.urdf"):
            client.upload_robot(arm_folder / "notes.txt")
        with pytest.raises(InvalidInputError, match="scale"):
            client.upload_robot(arm_folder, scale=0)
        with pytest.raises(InvalidInputError, match="geometry"):
            client.upload_robot(arm_folder, geometry="both")  # type: ignore[arg-type]  # what a caller may get wrong
        with pytest.raises(RefusedInputError, match="robot name"):
            client.upload_robot(arm_folder, "no name")
        (arm_folder / "arm.urdf").write_text("<robot>")
        with pytest.raises(RefusedInputError, match="not XML"):
            client.upload_robot(arm_folder, f"{name}-broken")
        (arm_folder / "large.stl").write_bytes(bytes(65 << 20))
        with pytest.raises(TooLargeError):
            client.upload_robot(arm_folder / "large.stl")


def test_the_async_client_has_the_same_calls(service: ServiceProcess, arm_folder: Path, name: str) -> None:
    async def all_of_them() -> None:
        async with AsyncClient(service.url) as client:
            robot = await client.upload_robot(arm_folder, name)
            assert await client.robot_info(name) == robot
            assert name in [listed.name for listed in await client.list_robots()]
            await client.delete_robot(name)
            with pytest.raises(RobotNotFoundError):
                await client.robot_info(name)

    asyncio.run(all_of_them())


def test_robot_documents_are_strict_json(service: ServiceProcess, name: str) -> None:
    put(service.http, name, arm_archive())
    text = service.http.get(f"/v1/robots/{name}").text
    assert json.loads(text, parse_constant=lambda constant: pytest.fail(constant))


def in_the_kernel(path: Path) -> rayvox.Robot | str:
    """The robot, or why it is none."""
    try:
        return rayvox.Robot.from_mesh(path)
    except rayvox.MeshFormatError as error:
        return str(error).rpartition(": ")[2]


def test_every_awkward_mesh_answers_queries_as_in_the_kernel_or_is_refused_with_the_reason(
    service: ServiceProcess, name: str
) -> None:
    client = Client(str(service.http.base_url))
    points = np.random.default_rng(0).uniform(-3, 3, (500, 3))
    client.create_map(f"{name}-map", resolution_m=0.1)
    client.insert_scan(f"{name}-map", points)
    local = rayvox.OccupancyMap(0.1)
    local.insert_scan(points)
    files = [*data_path("mesh_robustness").iterdir(), data_path("fcl_coal/illformated_mesh.dae")]
    meshes = [path for path in files if path.suffix.lower()[1:] in TYPES]
    assert len(meshes) >= 29
    for path in meshes:
        wanted = in_the_kernel(path)
        if isinstance(wanted, str):
            with pytest.raises(RefusedInputError, match=re.escape(wanted)):
                client.upload_robot(path, name)
            continue
        info = client.upload_robot(path, name)
        assert info.triangles == wanted.triangle_count
        T = np.tile(np.eye(4), (20, 1, 1))
        T[:, :3, 3] = np.random.default_rng(1).uniform(-3, 3, (20, 3)) - wanted.links[0].mesh.vertices.mean(axis=0)
        expected = rayvox.CollisionChecker(local.snapshot(), wanted).check(T_map_base=T).verdicts
        assert np.array_equal(client.check(f"{name}-map", info, T_map_base=T).verdicts, expected), path.name
        client.delete_robot(name)
