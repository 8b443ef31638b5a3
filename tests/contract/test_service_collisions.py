"""Collision queries over a real socket; the kernel itself says what the answers must be."""

from __future__ import annotations

import asyncio
import math
from typing import Any, Literal

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray
from rayvox_client import (
    AsyncClient,
    Client,
    InvalidInputError,
    RefusedInputError,
    RobotNotFoundError,
    ServiceTimeoutError,
    TooLargeError,
)
from rayvox_service.frame import encode_frame

from tests.support.arm_in_room import ARM
from tests.support.service_process import ServiceProcess, assert_problem

FRAME_HEADERS = {"content-type": "application/vnd.rayvox.frame"}
Poses = tuple[NDArray[np.float64], NDArray[np.float64]]


def poses(count: int) -> Poses:
    rng = np.random.default_rng(1)
    T = np.tile(np.eye(4), (count, 1, 1))
    angle = rng.uniform(0, 2 * np.pi, count)
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -np.sin(angle)
    T[:, :3, 3] = rng.uniform(-4, 4, (count, 3))
    return ARM.sample_configurations(count, rng), T


@pytest.mark.parametrize("unknown", ["free", "occupied"])
def test_verdicts_are_those_of_the_kernel_in_every_form(
    service: ServiceProcess,
    client: Client,
    robot: str,
    room: str,
    snapshot: rayvox.MapSnapshot,
    unknown: Literal["free", "occupied"],
) -> None:
    q, T = poses(2000)
    wanted = rayvox.CollisionChecker(snapshot, ARM, unknown, 0.02, 0.6).check(
        q, T, contacts="first", self_collision=True
    )
    got = client.check(
        room, robot, q, T, unknown=unknown, padding_m=0.02, occupancy_threshold=0.6, self_collision=True,
        contacts="first",
    )  # fmt: skip
    assert got.revision == wanted.revision == 1
    assert np.array_equal(got.verdicts, wanted.verdicts)
    assert len(set(got.verdicts.tolist())) == 2
    assert got.self_colliding is not None
    assert wanted.self_colliding is not None
    assert np.array_equal(got.self_colliding, wanted.self_colliding)
    assert got.contacts is not None
    assert wanted.contacts is not None
    assert np.array_equal(got.contacts.centre_m, wanted.contacts.centre_m)
    assert np.array_equal(got.contacts.log_odds, wanted.contacts.log_odds, equal_nan=True)
    simpler = rayvox.CollisionChecker(snapshot, ARM, unknown, accuracy_m=0.04).check(q, T).verdicts
    assert np.array_equal(client.check(room, robot, q, T, unknown=unknown, accuracy_m=0.04).verdicts, simpler)
    query = {
        "robot": robot, "unknown": unknown, "padding_m": 0.02, "occupancy_threshold": 0.6, "contacts": "first",
        "configurations": q[:20].tolist(), "T_map_base": T[:20].reshape(-1, 16).tolist(),
    }  # fmt: skip
    answer = service.http.post(f"/v1/maps/{room}/collisions", json=query).json()
    assert answer["verdicts"] == wanted.verdicts[:20].tolist()
    assert [c["pose"] for c in answer["contacts"]] == wanted.contacts.pose[wanted.contacts.pose < 20].tolist()
    first = answer["contacts"][0]
    assert first["centre_m"] == wanted.contacts.centre_m[0].tolist()
    assert (first["log_odds"] is None) == math.isnan(wanted.contacts.log_odds[0])


@pytest.mark.parametrize("unknown", ["free", "occupied"])
def test_clearances_are_those_of_the_kernel_in_every_form(
    service: ServiceProcess,
    client: Client,
    robot: str,
    room: str,
    snapshot: rayvox.MapSnapshot,
    unknown: Literal["free", "occupied"],
) -> None:
    q, T = poses(300)
    wanted = rayvox.CollisionChecker(snapshot, ARM, unknown, 0.02, 0.6).clearance(q, T, max_clearance_m=0.3)
    got = client.clearance(
        room, robot, q, T, max_clearance_m=0.3, unknown=unknown, padding_m=0.02, occupancy_threshold=0.6
    )
    for column in ("verdicts", "clearance_m", "is_lower_bound", "direction", "link", "point_m", "voxel_centre_m"):
        assert np.array_equal(getattr(got, column), getattr(wanted, column), equal_nan=True), column
    assert np.array_equal(got.voxel_size_m, wanted.voxel_size_m, equal_nan=True)
    assert got.revision == 1
    assert (got.verdicts != 0).any()
    assert got.is_lower_bound.any() == (unknown == "free")
    query: dict[str, Any] = {
        "robot": robot, "unknown": unknown, "padding_m": 0.02, "occupancy_threshold": 0.6, "clearance_m": 0.3,
        "configurations": q[:40].tolist(), "T_map_base": T[:40].reshape(-1, 16).tolist(),
    }  # fmt: skip
    answer = service.http.post(f"/v1/maps/{room}/collisions", json=query).json()
    assert answer["verdicts"] == wanted.verdicts[:40].tolist()
    for i, record in enumerate(answer["clearances"]):
        assert record["clearance_m"] == wanted.clearance_m[i]
        assert record["is_lower_bound"] is bool(wanted.is_lower_bound[i])
        assert record["link"] == wanted.link[i]
        found = wanted.link[i] >= 0
        assert record["direction"] == (wanted.direction[i].tolist() if found else None)
        assert (record["voxel_size_m"] is None) == math.isnan(wanted.voxel_size_m[i])


@pytest.mark.parametrize("bound", [0.0, -1.0, "far"])
def test_bounds_of_clearance_that_cannot_be_are_refused(
    service: ServiceProcess, client: Client, robot: str, room: str, bound: object
) -> None:
    query = {"robot": robot, "clearance_m": bound, "configurations": [ARM.configuration().tolist()]}
    assert_problem(service.http.post(f"/v1/maps/{room}/collisions", json=query), 422, "invalid-input")
    if isinstance(bound, float):
        with pytest.raises(InvalidInputError):
            client.clearance(room, robot, ARM.configuration(), max_clearance_m=bound)


def test_the_async_client_answers_alike(service: ServiceProcess, client: Client, robot: str, room: str) -> None:
    q, T = poses(100)

    async def ask() -> NDArray[np.uint8]:
        key = service.http.headers.get("authorization", "").removeprefix("Bearer ") or None
        async with AsyncClient(str(service.http.base_url), key) as opened:
            return (await opened.check(room, robot, q, T)).verdicts

    assert np.array_equal(asyncio.run(ask()), client.check(room, robot, q, T).verdicts)


def test_one_configuration_goes_with_many_bases_and_the_other_way_round(client: Client, robot: str, room: str) -> None:
    q, T = poses(30)
    assert len(client.check(room, robot, q[0], T).verdicts) == 30
    assert len(client.check(room, robot, q).verdicts) == 30
    assert len(client.check(room, robot, q[0], T[0]).verdicts) == 1
    with pytest.raises(InvalidInputError):
        client.check(room, robot, q[:3], T)


def test_a_query_waits_for_its_revision_or_times_out(client: Client, robot: str) -> None:
    client.create_map("late", resolution_m=0.1)
    assert client.check("late", robot, ARM.configuration(), unknown="occupied").verdicts.tolist() == [2]
    client.insert_scan("late", [[0.0, 0.0, 0.05]], wait="journaled")
    seen = client.check("late", robot, ARM.configuration(), min_revision=1)
    assert (seen.revision, seen.verdicts.tolist()) == (1, [1])
    with pytest.raises(ServiceTimeoutError):
        client.check("late", robot, ARM.configuration(), min_revision=5)


@pytest.mark.parametrize(
    "changed",
    [
        {"configurations": [[0.0]]},
        {"configurations": [[0.0] * 5, [0.0] * 4]},
        {"T_map_base": [[1.0] * 16]},
        {"T_map_base": [[1.0] * 15]},
        {"padding_m": -1},
        {"occupancy_threshold": 1.5},
        {"accuracy_m": 0},
        {"unknown": "maybe"},
        {"contacts": "some"},
        {"colour": "red"},
    ],
)
def test_a_collision_query_that_makes_no_sense_is_refused(
    service: ServiceProcess, robot: str, room: str, changed: dict[str, Any]
) -> None:
    query = {"robot": robot, "configurations": [[0.0, 0.0, 0.0, 1.0, 0.0]], **changed}
    assert_problem(service.http.post(f"/v1/maps/{room}/collisions", json=query), 422, "invalid-input")


def test_frames_robots_and_numbers_of_poses_that_do_not_fit_are_refused(
    service: ServiceProcess, client: Client, robot: str, room: str
) -> None:
    url = f"/v1/maps/{room}/collisions"
    wrong = encode_frame("collisions", {"robot": robot}, {"configurations": np.zeros((1, 5, 1))})
    assert_problem(service.http.post(url, content=wrong, headers=FRAME_HEADERS), 422, "invalid-input")
    wrong = encode_frame("rays", {"robot": robot}, {"configurations": np.zeros((1, 5))})
    assert_problem(service.http.post(url, content=wrong, headers=FRAME_HEADERS), 422, "invalid-input")
    with pytest.raises(RobotNotFoundError):
        client.check(room, "nobody", ARM.configuration())
    with pytest.raises(TooLargeError):
        client.check(room, robot, ARM.configuration(), np.tile(np.eye(4), (200_001, 1, 1)))
    with pytest.raises(TooLargeError):
        client.check(room, robot, ARM.configuration(), np.tile(np.eye(4), (101, 1, 1)), contacts="all")
    with pytest.raises(RefusedInputError):
        client.check(room, robot, ARM.configuration(), 2 * np.eye(4))
