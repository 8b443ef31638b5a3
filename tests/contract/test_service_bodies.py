"""Bodies on their way in: however they are cut, the service takes the same bytes."""

from __future__ import annotations

import asyncio
import json
import socket
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from rayvox_service.app import create_app
from rayvox_service.frame import MEDIA_TYPE
from rayvox_service.settings import Settings
from rayvox_service.whole_body import MIN_BYTES

from tests.support.service_process import (
    FRAME_HEADERS,
    ServiceProcess,
    create_map,
    scan_frame,
    served_leaves,
    some_points,
)


class RawConnection:
    """HTTP/1.1 by hand on one connection."""

    def __init__(self, service: ServiceProcess) -> None:
        self._socket = socket.create_connection(("127.0.0.1", int(service.url.rsplit(":", 1)[1])), 20)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = self._socket.makefile("rb")

    def __enter__(self) -> RawConnection:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()
        self._socket.close()

    def send(self, data: bytes) -> None:
        self._socket.sendall(data)

    def answer(self) -> tuple[int, dict[str, Any]]:
        """Status and JSON of the next answer; informational ones without JSON."""
        status, length = int(self._reader.readline().split()[1]), 0
        while (line := self._reader.readline()) not in (b"\r\n", b""):
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        return status, json.loads(self._reader.read(length) or b"{}")


def put_head(name: str, scan_id: uuid.UUID, length: str) -> bytes:
    lines = [f"PUT /v1/maps/{name}/scans/{scan_id}?wait=applied HTTP/1.1", "Host: x", f"Content-Type: {MEDIA_TYPE}"]
    return "\r\n".join([*lines, length, "", ""]).encode()


def large_scan(seed: int = 0) -> tuple[uuid.UUID, bytes]:
    scan_id, data = scan_frame(some_points(seed, 20_000))
    assert len(data) > 3 * MIN_BYTES
    return scan_id, data


@pytest.fixture
def raw(service: ServiceProcess) -> Iterator[RawConnection]:
    with RawConnection(service) as connection:
        yield connection


@pytest.mark.parametrize("first", [0, 1, 1000, MIN_BYTES, MIN_BYTES + 1, 200_000])
def test_a_large_body_may_arrive_in_pieces(raw: RawConnection, lab: str, first: int) -> None:
    scan_id, data = large_scan()
    raw.send(put_head(lab, scan_id, f"Content-Length: {len(data)}") + data[:first])
    time.sleep(0.05)
    for start in range(first, len(data), 50_000):
        raw.send(data[start : min(start + 50_000, len(data))])
        time.sleep(0.005)
    assert raw.answer()[0] == 201


def test_large_bodies_may_follow_each_other_without_waiting_for_answers(raw: RawConnection, lab: str) -> None:
    scans = [large_scan(seed) for seed in range(4)]
    requests = [put_head(lab, scan_id, f"Content-Length: {len(data)}") + data for scan_id, data in scans]
    raw.send(b"".join(requests) + b"GET /v1/health HTTP/1.1\r\nHost: x\r\n\r\n")
    answers = [raw.answer() for _ in scans]
    assert [(status, answer["scan_id"]) for status, answer in answers] == [(201, str(scan_id)) for scan_id, _ in scans]
    assert raw.answer() == (200, {"status": "ok"})


def test_a_large_body_may_come_in_chunks_of_unannounced_length(raw: RawConnection, lab: str) -> None:
    scan_id, data = large_scan()
    raw.send(put_head(lab, scan_id, "Transfer-Encoding: chunked"))
    for start in range(0, len(data), 70_000):
        piece = data[start : start + 70_000]
        raw.send(b"%x\r\n%b\r\n" % (len(piece), piece))
    raw.send(b"0\r\n\r\n")
    assert raw.answer()[0] == 201


def test_a_sender_that_waits_to_be_told_to_continue_is_told(raw: RawConnection, lab: str) -> None:
    scan_id, data = large_scan()
    raw.send(put_head(lab, scan_id, f"Content-Length: {len(data)}\r\nExpect: 100-continue"))
    assert raw.answer()[0] == 100
    raw.send(data)
    assert raw.answer()[0] == 201


def test_a_connection_that_ends_within_a_large_body_changes_nothing(service: ServiceProcess, lab: str) -> None:
    scan_id, data = large_scan()
    for sent in (100, MIN_BYTES + 1, len(data) - 1):
        with RawConnection(service) as broken:
            broken.send(put_head(lab, scan_id, f"Content-Length: {len(data)}") + data[:sent])
            time.sleep(0.05)
    with RawConnection(service) as whole:
        whole.send(put_head(lab, scan_id, f"Content-Length: {len(data)}") + data)
        status, receipt = whole.answer()
    assert (status, receipt["sequence"], receipt["duplicate"]) == (201, 1, False)


def test_a_large_body_refused_by_its_head_leaves_the_connection_usable(raw: RawConnection, lab: str) -> None:
    scan_id, data = large_scan()
    raw.send(put_head("no-such-map", scan_id, f"Content-Length: {len(data)}"))
    status, problem = raw.answer()
    assert (status, problem["type"]) == (404, "urn:rayvox:problem:map-not-found")
    raw.send(data + put_head(lab, scan_id, f"Content-Length: {len(data)}") + data)
    assert raw.answer()[0] == 201


def test_a_large_body_that_is_too_slow_is_answered_and_its_rest_thrown_away(tmp_path: Path) -> None:
    scan_id, data = large_scan()
    with ServiceProcess(tmp_path, body_timeout_s=0.3, quiet=True) as service:
        create_map(service.await_ready().http, "lab")
        with RawConnection(service) as slow:
            slow.send(put_head("lab", scan_id, f"Content-Length: {len(data)}") + data[:150_000])
            status, problem = slow.answer()
            assert (status, problem["type"]) == (408, "urn:rayvox:problem:request-timeout")
            slow.send(data[150_000:] + put_head("lab", scan_id, f"Content-Length: {len(data)}") + data)
            status, receipt = slow.answer()
    assert (status, receipt["sequence"], receipt["duplicate"]) == (201, 1, False)


def test_a_server_that_knows_only_plain_asgi_serves_the_same_application(
    service: ServiceProcess, tmp_path: Path
) -> None:
    scan_id, data = large_scan()
    url = f"/v1/maps/plain/scans/{scan_id}?wait=applied"

    async def upload() -> tuple[httpx.Response, httpx.Response]:
        app = create_app(Settings(data_dir=tmp_path, fsync=False))
        transport = httpx.ASGITransport(app)
        async with (
            app.router.lifespan_context(app),
            httpx.AsyncClient(transport=transport, base_url="http://x") as http,
        ):
            while (await http.get("/v1/ready")).status_code != 200:
                await asyncio.sleep(0.01)
            await http.post("/v1/maps", json={"name": "plain", "resolution_m": 0.25})
            stored = await http.put(url, content=data, headers=FRAME_HEADERS)
            return stored, await http.get("/v1/maps/plain/export?format=ot")

    stored, exported = asyncio.run(upload())
    assert stored.status_code == 201, stored.text
    create_map(service.http, "plain")
    assert service.http.put(url, content=data, headers=FRAME_HEADERS).status_code == 201
    assert served_leaves(service.http, "plain")
    assert exported.content == service.http.get("/v1/maps/plain/export?format=ot").content
