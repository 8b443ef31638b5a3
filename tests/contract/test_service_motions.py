"""Motions, and robots changed for a query, over a real socket; the kernel itself says what the answers must be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rayvox
from rayvox.robot.primitives import box_mesh, cylinder_mesh, sphere_mesh
from rayvox_client import AttachedObject, Client, InvalidInputError, RefusedInputError, TooLargeError
from rayvox_service.frame import encode_frame

from tests.support.arm_in_room import ARM
from tests.support.robots import CUBE_STL
from tests.support.service_process import ServiceProcess, assert_problem


def placed(x: float) -> Any:
    T = np.eye(4)
    T[0, 3] = x
    return T


def turned_by(angle: float) -> Any:
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return T


def test_motions_are_those_of_the_kernel_in_every_form(
    service: ServiceProcess, client: Client, robot: str, room: str, snapshot: rayvox.MapSnapshot
) -> None:
    path = ARM.sample_configurations(301, np.random.default_rng(1))
    options: Any = {"padding_m": 0.01, "occupancy_threshold": 0.6}
    wanted = rayvox.CollisionChecker(snapshot, ARM, **options).check_motion(
        path[:-1], path[1:], placed(-2.5), tolerance_m=0.02
    )
    got = client.check_motion(room, robot, path[:-1], path[1:], placed(-2.5), tolerance_m=0.02, **options)
    assert (got.revision, got.tolerance_m) == (1, 0.02)
    assert np.array_equal(got.verdicts, wanted.verdicts)
    assert np.array_equal(got.free_until, wanted.free_until)
    assert 0 < got.free.sum() < 300
    asked = {
        "robot": robot, "q_from": path[:5].tolist(), "q_to": path[1:6].tolist(), "tolerance_m": 0.02, **options,
        "T_map_base": [placed(-2.5).ravel().tolist()],
    }  # fmt: skip
    answer = service.http.post(f"/v1/maps/{room}/motions", json=asked).json()
    assert answer["free_until"] == wanted.free_until[:5].tolist()
    assert answer["verdicts"] == wanted.verdicts[:5].tolist()
    assert answer["revision"] == 1


def test_a_base_that_moves_is_checked_on_its_way(
    service: ServiceProcess, client: Client, robot: str, room: str, snapshot: rayvox.MapSnapshot
) -> None:
    path = ARM.sample_configurations(41, np.random.default_rng(3))
    T_to = np.stack([placed(x) @ turned_by(0.05 * x) for x in np.linspace(-3.0, 3.0, 40)])
    wanted = rayvox.CollisionChecker(snapshot, ARM).check_motion(path[:-1], path[1:], placed(-3.0), T_to)
    got = client.check_motion(room, robot, path[:-1], path[1:], placed(-3.0), T_map_base_to=T_to)
    with client.open_queries(room) as questions:
        streamed = questions.check_motion(robot, path[:-1], path[1:], placed(-3.0), T_map_base_to=T_to)
    for answer in (got, streamed):
        assert np.array_equal(answer.verdicts, wanted.verdicts)
        assert np.array_equal(answer.free_until, wanted.free_until)
    resting = client.check_motion(room, robot, path[:-1], path[1:], placed(-3.0))
    assert not np.array_equal(got.free_until, resting.free_until)
    asked = {
        "robot": robot, "q_from": path[:-1].tolist(), "q_to": path[1:].tolist(),
        "T_map_base": [placed(-3.0).ravel().tolist()], "T_map_base_to": T_to.reshape(-1, 16).tolist(),
    }  # fmt: skip
    in_json = service.http.post(f"/v1/maps/{room}/motions", json=asked).json()
    assert in_json["free_until"] == wanted.free_until.tolist()


def test_a_rigid_robot_moves_by_its_base_alone(
    client: Client, room: str, snapshot: rayvox.MapSnapshot, tmp_path: Path
) -> None:
    (tmp_path / "cube.stl").write_bytes(CUBE_STL)
    cube = rayvox.Robot.from_mesh(tmp_path / "cube.stl")
    client.upload_robot(tmp_path / "cube.stl", "rigid-cube")
    wanted = rayvox.CollisionChecker(snapshot, cube).check_motion(None, None, placed(-9.0), placed(0.0))
    got = client.check_motion(room, "rigid-cube", None, None, placed(-9.0), T_map_base_to=placed(0.0))
    assert np.array_equal(got.free_until, wanted.free_until)
    assert 0 < got.free_until[0] < 1


def test_motions_that_make_no_sense_are_refused(service: ServiceProcess, client: Client, robot: str, room: str) -> None:
    q = ARM.sample_configurations(4, np.random.default_rng(1))
    url, headers = f"/v1/maps/{room}/motions", {"content-type": "application/vnd.rayvox.frame"}
    for ends in ({"q_from": q}, {"q_from": q, "q_to": q[:3]}, {"q_from": q, "q_to": q, "extra": q}):
        content = encode_frame("motions", {"robot": robot}, ends)
        assert_problem(service.http.post(url, content=content, headers=headers), 422, "invalid-input")
    with pytest.raises(InvalidInputError):
        client.check_motion(room, robot, q, q[:3])
    with pytest.raises(RefusedInputError):
        client.check_motion(room, robot, q, q, tolerance_m=0.0)
    with pytest.raises(RefusedInputError):
        client.check_motion(room, robot, q[:, :2], q[:, :2])
    with pytest.raises(TooLargeError):
        client.check_motion(room, robot, q[0], np.zeros((200_001, q.shape[1])))


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere"])
def test_a_held_object_collides_and_is_named_in_contacts(
    client: Client, robot: str, room: str, snapshot: rayvox.MapSnapshot, shape: str
) -> None:
    sizes: dict[str, Any] = {"box": (0.3, 0.2, 0.6), "cylinder": (0.2, 0.7), "sphere": 0.4}
    match shape:
        case "box":
            mesh = box_mesh(sizes["box"])
        case "cylinder":
            mesh = cylinder_mesh(*sizes["cylinder"])[0]
        case _:
            mesh = sphere_mesh(sizes["sphere"])[0]
    q, T = ARM.sample_configurations(300, np.random.default_rng(2)), placed(-2.0)
    held = AttachedObject(
        "hand", placed(0.3), name="load", padding_m=0.01, touch_links=["left"], **{shape: sizes[shape]}
    )
    got = client.check(room, robot, q, T, attached=[held], contacts="first", self_collision=True)
    holding = ARM.with_attached("load", mesh, "hand", placed(0.3), ["left"], 0.01)
    wanted = rayvox.CollisionChecker(snapshot, holding).check(q, T, contacts="first", self_collision=True)
    assert np.array_equal(got.verdicts, wanted.verdicts)
    assert (got.verdicts > client.check(room, robot, q, T).verdicts).any()
    assert got.self_colliding is not None
    assert wanted.self_colliding is not None
    assert np.array_equal(got.self_colliding, wanted.self_colliding)
    assert got.contacts is not None
    # The object comes behind the robot's own links.
    assert got.contacts.link.max() == len(ARM.links)


def test_padding_goes_to_the_named_links(client: Client, robot: str, room: str, snapshot: rayvox.MapSnapshot) -> None:
    q, T = ARM.sample_configurations(400, np.random.default_rng(3)), np.stack([placed(-x / 100) for x in range(400)])
    padded = {"upper": 0.3, "hand": 0.2}
    got = client.check(room, robot, q, T, padding_m=padded).verdicts
    wanted = rayvox.CollisionChecker(snapshot, ARM.with_padding(padded)).check(q, T).verdicts
    assert np.array_equal(got, wanted)
    assert (got > client.check(room, robot, q, T).verdicts).any()
    with pytest.raises(RefusedInputError):
        client.check(room, robot, q, T, padding_m={"tail": 0.1})


def test_pairs_that_may_touch_are_the_querys_to_change(client: Client, robot: str, room: str) -> None:
    q = ARM.sample_configurations(400, np.random.default_rng(4))
    plain = client.check(room, robot, q, self_collision=True).self_colliding
    pairs = [(a.name, b.name) for i, a in enumerate(ARM.links) for b in ARM.links[:i]]
    lenient = client.check(room, robot, q, self_collision=True, allow=pairs).self_colliding
    strict = client.check(room, robot, q, self_collision=True, forbid=pairs).self_colliding
    assert plain is not None
    assert lenient is not None
    assert strict is not None
    assert 0 < plain.sum() < 400
    assert not lenient.any()
    assert strict.all()
    with pytest.raises(RefusedInputError):
        client.check(room, robot, q, self_collision=True, allow=[("hand", "tail")])


@pytest.mark.parametrize(
    "held",
    [
        {"link": "tail", "sphere": 0.1},
        {"link": "hand"},
        {"link": "hand", "sphere": 0.1, "box": [1, 1, 1]},
        {"link": "hand", "sphere": -0.1},
        {"link": "hand", "sphere": 0.1, "name": "upper"},
        {"link": "hand", "sphere": 0.1, "T_link_object": [1.0] * 16},
    ],
)
def test_objects_that_cannot_be_held_are_refused(
    service: ServiceProcess, robot: str, room: str, held: dict[str, Any]
) -> None:
    query = {"robot": robot, "configurations": [ARM.configuration().tolist()], "attached": [held]}
    assert_problem(service.http.post(f"/v1/maps/{room}/collisions", json=query), 422, "invalid-input")
