"""Questions under load: long ones give way and end with their client, answers are of one revision each."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest
import rayvox
from numpy.typing import NDArray
from rayvox_client import Client
from rayvox_service.frame import MEDIA_TYPE, encode_frame

from tests.support.robots import arm_archive
from tests.support.service_process import ServiceProcess, some_points

ARM = rayvox.Robot.from_archive(arm_archive())
RESOLUTION_M = 0.05
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def busy_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """With one query thread only, and a map that has a robot in its midst."""
    with ServiceProcess(tmp_path_factory.mktemp("busy"), query_threads=1) as running:
        client = Client(running.await_ready().url)
        running.http.put("/v1/robots/arm", content=arm_archive(), headers={"content-type": "application/zip"})
        client.create_map("lab", resolution_m=RESOLUTION_M)
        client.insert_scan("lab", some_points(0, 2000))
        yield running


def hours_of_work() -> bytes:
    """A question that keeps the kernel busy for very much longer than any of these tests takes."""
    rng = np.random.default_rng(0)
    ends = {name: ARM.sample_configurations(200_000, rng) for name in ("q_from", "q_to")}
    return encode_frame("motions", {"robot": "arm", "tolerance_m": 1e-4, "padding_m": 0.0}, ends)


def post(service: ServiceProcess, body: bytes) -> socket.socket:
    host, port = service.url.removeprefix("http://").split(":")
    connection = socket.create_connection((host, int(port)))
    head = f"POST /v1/maps/lab/motions HTTP/1.1\r\nHost: x\r\nContent-Type: {MEDIA_TYPE}\r\nContent-Length: {len(body)}"
    connection.sendall(head.encode() + b"\r\n\r\n" + body)
    return connection


def cpu_s(service: ServiceProcess) -> float:
    times = psutil.Process(service.process.pid).cpu_times()
    return float(times.user + times.system)


def await_work(service: ServiceProcess) -> None:
    begun, deadline = cpu_s(service), time.monotonic() + PATIENCE_S
    while cpu_s(service) < begun + 0.5:
        assert time.monotonic() < deadline, "the service does not work on the question"
        time.sleep(0.02)


def await_rest(service: ServiceProcess) -> None:
    deadline = time.monotonic() + PATIENCE_S
    before = cpu_s(service)
    while True:
        time.sleep(0.5)
        now = cpu_s(service)
        if now - before < 0.05:
            return
        assert time.monotonic() < deadline, "the service still works though nobody waits for the answer"
        before = now


def test_a_client_that_hangs_up_ends_its_query(busy_service: ServiceProcess) -> None:
    connection = post(busy_service, hours_of_work())
    await_work(busy_service)
    connection.close()
    await_rest(busy_service)


def test_a_client_that_closes_its_socket_ends_its_queries(busy_service: ServiceProcess) -> None:
    q = ARM.sample_configurations(200_000, np.random.default_rng(0))
    queries = Client(busy_service.url).open_queries("lab")
    queries.open()
    for _ in range(3):
        queries.send_check_motion("arm", q[:-1], q[1:], tolerance_m=1e-4)
    await_work(busy_service)
    queries.close()
    await_rest(busy_service)


def test_long_queries_hold_up_neither_scans_nor_short_ones(busy_service: ServiceProcess) -> None:
    client, body = Client(busy_service.url), hours_of_work()
    connections = [post(busy_service, body) for _ in range(3)]
    try:
        await_work(busy_service)
        for seed in range(3):
            receipt = client.insert_scan("lab", some_points(seed, 2000))
            assert client.occupancy("lab", [[0.0, 0.0, 0.0]], min_revision=receipt.revision).revision >= 2
            assert (
                len(client.check("lab", "arm", ARM.sample_configurations(50, np.random.default_rng(0))).verdicts) == 50
            )
    finally:
        for connection in connections:
            connection.close()
    await_rest(busy_service)


def test_each_answer_is_of_exactly_one_revision_while_scans_stream_in(tmp_path: Path) -> None:
    scans = [some_points(seed, 3000) for seed in range(60)]
    local, snapshots = rayvox.OccupancyMap(RESOLUTION_M), {}
    snapshots[0] = local.snapshot()
    for points in scans:
        local.insert_scan(points)
        snapshots[local.revision] = local.snapshot()
    q = ARM.sample_configurations(3000, np.random.default_rng(1))
    T: NDArray[np.float64] = np.tile(np.eye(4), (len(q), 1, 1))
    T[:, :3, 3] = np.random.default_rng(2).uniform(-5, 5, (len(q), 3))
    with ServiceProcess(tmp_path) as running:
        client = Client(running.await_ready().url)
        running.http.put("/v1/robots/arm", content=arm_archive(), headers={"content-type": "application/zip"})
        client.create_map("lab", resolution_m=RESOLUTION_M)

        def upload() -> None:
            with Client(running.url).stream("lab") as stream:
                for points in scans:
                    stream.push(points)

        uploading = threading.Thread(target=upload)
        uploading.start()
        answers = []
        with client.open_queries("lab") as queries:
            while uploading.is_alive() or answers[-1].revision < len(scans):
                answers.append(queries.check("arm", q, T))
        uploading.join()
    assert answers[-1].revision == len(scans)
    assert len({answer.revision for answer in answers}) > 3
    for answer in answers:
        wanted = rayvox.CollisionChecker(snapshots[answer.revision], ARM).check(q, T)
        assert np.array_equal(answer.verdicts, wanted.verdicts)
