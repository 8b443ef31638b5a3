"""Questions over a WebSocket; the same questions over HTTP and the kernel say what the answers must be."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox_client import (
    AsyncClient,
    Client,
    InvalidInputError,
    MapNotFoundError,
    RefusedInputError,
    RobotNotFoundError,
)
from rayvox_service.frame import UNLIMITED, Frame, decode_frame, encode_frame
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tests.support.arm_in_room import ARM, ROOM_POINTS
from tests.support.robots import arm_archive
from tests.support.service_process import ServiceProcess


def configurations(count: int, seed: int = 1) -> NDArray[np.float64]:
    return ARM.sample_configurations(count, np.random.default_rng(seed))


@contextmanager
def raw_connection(service: ServiceProcess, name: str) -> Iterator[ClientConnection]:
    address = str(service.http.base_url).replace("http", "ws", 1)
    with connect(f"{address}/v1/maps/{name}/queries", max_size=None, compression=None) as connection:
        assert json.loads(connection.recv())["type"] == "opened"
        yield connection


def answer(socket: ClientConnection) -> Frame:
    message = socket.recv()
    assert isinstance(message, bytes)
    return decode_frame(message, UNLIMITED)


def keep_asking(socket: ClientConnection, frame: bytes) -> None:
    for _ in range(100):
        socket.send(frame)
    while True:
        socket.recv()


def test_answers_are_those_of_http(client: Client, robot: str, room: str) -> None:
    q = configurations(10_000)
    over_http = client.check(room, robot, q, unknown="occupied", self_collision=True, contacts="first")
    with client.open_queries(room) as queries:
        over_socket = queries.check(robot, q, unknown="occupied", self_collision=True, contacts="first")
        motions = queries.check_motion(robot, q[:-1:100], q[1::100])
    assert over_socket.revision == over_http.revision == 1
    assert np.array_equal(over_socket.verdicts, over_http.verdicts)
    assert over_socket.self_colliding is not None
    assert over_http.self_colliding is not None
    assert np.array_equal(over_socket.self_colliding, over_http.self_colliding)
    assert over_socket.contacts is not None
    assert over_http.contacts is not None
    assert np.array_equal(over_socket.contacts.centre_m, over_http.contacts.centre_m)
    assert np.array_equal(over_socket.contacts.pose, np.flatnonzero(over_socket.verdicts == 1))
    assert np.array_equal(motions.free_until, client.check_motion(room, robot, q[:-1:100], q[1::100]).free_until)


def test_questions_sent_ahead_are_answered_in_order(client: Client, robot: str, room: str) -> None:
    batches = [configurations(200, seed) for seed in range(40)]
    with client.open_queries(room) as queries:
        pending = [queries.send_check(robot, batch) for batch in batches]
        answers = [answer.result().verdicts for answer in reversed(pending)]
    for batch, verdicts in zip(reversed(batches), answers, strict=True):
        assert np.array_equal(verdicts, client.check(room, robot, batch).verdicts)


def test_an_error_belongs_to_its_question_and_keeps_the_connection(client: Client, robot: str, room: str) -> None:
    q = configurations(3)
    with client.open_queries(room) as queries:
        pending = [
            queries.send_check(robot, q),
            queries.send_check("nobody", q),
            queries.send_check(robot, q[:, :2]),
            queries.send_check(robot, q, 2 * np.eye(4)),
            queries.send_check(robot, q, min_revision=1),
        ]
        assert len(pending[0].result().verdicts) == 3
        with pytest.raises(RobotNotFoundError):
            pending[1].result()
        with pytest.raises(RefusedInputError):
            pending[2].result()
        with pytest.raises(RefusedInputError):
            pending[3].result()
        assert len(pending[4].result().verdicts) == 3
        with pytest.raises(InvalidInputError):
            queries.check(robot, q[:2], np.tile(np.eye(4), (3, 1, 1)))
        assert len(queries.check(robot, q).verdicts) == 3


def test_a_question_waits_for_its_revision_or_times_out(service: ServiceProcess, client: Client, room: str) -> None:
    with raw_connection(service, room) as socket:
        ask = {"min_revision": 2, "timeout_s": 0.05}
        socket.send(encode_frame("points", ask, {"points": np.zeros((1, 3))}))
        error = json.loads(socket.recv())
        assert (error["type"], error["problem"]["status"]) == ("error", 504)
        socket.send(encode_frame("points", {"min_revision": 2}, {"points": np.zeros((1, 3))}))
        client.insert_scan(room, ROOM_POINTS)
        assert answer(socket).fields["revision"] == 2


def test_points_boxes_and_rays_can_be_asked_too_and_nonsense_is_an_error(service: ServiceProcess, room: str) -> None:
    with raw_connection(service, room) as socket:
        socket.send(encode_frame("points", {}, {"points": ROOM_POINTS}))
        socket.send(encode_frame("rays", {"max_range_m": 5.0}, {"origins": 0 * ROOM_POINTS, "directions": ROOM_POINTS}))
        socket.send(b"nonsense")
        socket.send(encode_frame("scan", {}, {"points": ROOM_POINTS}))
        socket.send("text")
        socket.send(encode_frame("boxes", {}, {"lo": ROOM_POINTS - 0.1, "hi": ROOM_POINTS + 0.1}))
        states = answer(socket)
        assert (states.kind, len(states.array("states"))) == ("occupancy", 400)
        assert answer(socket).kind == "hits"
        slugs = [json.loads(socket.recv())["problem"]["type"].rpartition(":")[2] for _ in range(3)]
        assert slugs == ["invalid-frame", "invalid-input", "invalid-frame"]
        assert answer(socket).array("states").tolist() == [2] * 400


def test_a_client_that_does_not_wait_for_answers_is_closed(service: ServiceProcess, robot: str, room: str) -> None:
    frame = encode_frame(
        "collisions", {"robot": robot, "self_collision": True}, {"configurations": configurations(5000)}
    )
    with raw_connection(service, room) as socket, pytest.raises(ConnectionClosed) as closed:
        keep_asking(socket, frame)
    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1008, "overloaded")


def test_a_map_that_is_not_there_is_refused_and_one_deleted_later_is_an_error(
    client: Client, robot: str, room: str
) -> None:
    with pytest.raises(MapNotFoundError):
        client.open_queries("nowhere").open()
    with client.open_queries(room) as queries:
        client.delete_map(room)
        with pytest.raises(MapNotFoundError):
            queries.check(robot, configurations(1))


def test_the_async_client_asks_alike(service: ServiceProcess, client: Client, robot: str, room: str) -> None:
    q = configurations(500)

    async def ask() -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
        async with AsyncClient(str(service.http.base_url)) as opened, opened.open_queries(room) as queries:
            first = await queries.send_check(robot, q)
            motions = await queries.check_motion(robot, q[0], q[1:9])
            return (await first.result()).verdicts, motions.free_until

    verdicts, free_until = asyncio.run(ask())
    assert np.array_equal(verdicts, client.check(room, robot, q).verdicts)
    assert np.array_equal(free_until, client.check_motion(room, robot, q[0], q[1:9]).free_until)


def test_a_broken_connection_is_opened_again_and_asked_again(tmp_path: Path) -> None:
    q = configurations(100)
    with ServiceProcess(tmp_path) as first:
        client = Client(first.await_ready().url)
        first.http.put("/v1/robots/arm", content=arm_archive(), headers={"content-type": "application/zip"})
        client.create_map("lab", resolution_m=0.1)
        client.insert_scan("lab", ROOM_POINTS)
        queries = client.open_queries("lab")
        wanted = queries.check("arm", q).verdicts
        pending = queries.send_check("arm", q)
        first.kill()
    with ServiceProcess(tmp_path, port=port_of(first)) as second:
        second.await_ready()
        assert np.array_equal(pending.result().verdicts, wanted)
        assert np.array_equal(queries.check("arm", q).verdicts, wanted)
        queries.close()


def port_of(service: ServiceProcess) -> str:
    return service.url.rpartition(":")[2]
