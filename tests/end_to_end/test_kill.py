from __future__ import annotations

import json
import random
import threading
import time
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest
from rayvox import OccupancyMap
from rayvox_service.journal_record import record_header
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from tests.support.service_nursery import ServiceNursery
from tests.support.service_process import create_map, leaf_dict, put_scan, scan_frame, served_leaves, some_points

KILLS = 50
RESOLUTION_M = 0.25
STREAM_IN_FLIGHT = 4
NAMESPACE = uuid.UUID(int=7)


def numbered_scan(uploader: str, number: int) -> tuple[uuid.UUID, bytes, int]:
    """Id, frame and points' seed; the same again on every call."""
    seed = 100_000 * (sum(map(ord, uploader)) % 97) + number
    scan_id, data = scan_frame(some_points(seed, 150), uuid.uuid5(NAMESPACE, f"{uploader} {number}"))
    return scan_id, data, seed


@dataclass
class Address:
    """Where the service is at the moment; uploaders wait here while it is dead."""

    changed: threading.Condition = field(default_factory=threading.Condition)
    url: str | None = None
    stopped: bool = False

    def set(self, url: str | None) -> None:
        with self.changed:
            self.url = url
            self.changed.notify_all()

    def stop(self) -> None:
        with self.changed:
            self.stopped = True
            self.changed.notify_all()

    def get(self) -> str | None:
        """None once the uploaders are to end."""
        with self.changed:
            self.changed.wait_for(lambda: self.stopped or self.url is not None)
            return None if self.stopped else self.url


class Uploader(threading.Thread):
    """Sends its own scans in order, notes the sequence of each acknowledgement, resends what got none."""

    in_flight = 1

    def __init__(self, name: str, address: Address) -> None:
        super().__init__(name=name, daemon=True)
        self.address = address
        self.acknowledged: dict[int, int] = {}
        self.failure: BaseException | None = None

    def run(self) -> None:
        try:
            while (url := self.address.get()) is not None:
                try:
                    self.upload(url)
                except (httpx.TransportError, WebSocketException, OSError):
                    time.sleep(0.002)
        except BaseException as error:
            self.failure = error
            raise

    def upload(self, url: str) -> None:
        raise NotImplementedError

    def note(self, number: int, sequence: int) -> None:
        assert self.acknowledged.setdefault(number, sequence) == sequence, "a scan has two sequences"


class HttpUploader(Uploader):
    def upload(self, url: str) -> None:
        with httpx.Client(base_url=url, timeout=20) as http:
            while not self.address.stopped:
                number = len(self.acknowledged)
                scan_id, data, _ = numbered_scan(self.name, number)
                response = put_scan(http, "lab", scan_id, data, wait=random.choice(["journaled", "applied"]))
                if response.status_code != 503:
                    assert response.status_code in (200, 201), response.text
                    self.note(number, response.json()["sequence"])


class StreamUploader(Uploader):
    in_flight = STREAM_IN_FLIGHT

    def upload(self, url: str) -> None:
        with connect(url.replace("http", "ws") + "/v1/maps/lab/stream", compression=None) as stream:
            assert json.loads(stream.recv())["type"] == "opened"
            sent = len(self.acknowledged)
            while not self.address.stopped:
                while sent < len(self.acknowledged) + STREAM_IN_FLIGHT:
                    stream.send(numbered_scan(self.name, sent)[1])
                    sent += 1
                self.take_acknowledgement(stream)

    def take_acknowledgement(self, stream: ClientConnection) -> None:
        message: dict[str, Any] = json.loads(stream.recv(timeout=20))
        number = len(self.acknowledged)
        assert message["type"] == "ack", message
        assert message["scan_id"] == str(numbered_scan(self.name, number)[0]), "acknowledgements are out of order"
        self.note(number, message["sequence"])


def await_map(url: str) -> dict[str, Any]:
    with httpx.Client(base_url=url, timeout=20) as http:
        deadline = time.monotonic() + 30
        while http.get("/v1/ready").status_code != 200:
            assert time.monotonic() < deadline, "the service did not become ready"
            time.sleep(0.002)
        info: dict[str, Any] = http.get("/v1/maps/lab").json()
        return info


def assert_nothing_lost_or_doubled(info: dict[str, Any], uploaders: list[Uploader]) -> None:
    for uploader in uploaders:
        assert uploader.failure is None, uploader.failure
    acknowledged = sum(len(uploader.acknowledged) for uploader in uploaders)
    in_flight = sum(uploader.in_flight for uploader in uploaders)
    assert acknowledged <= info["scans_acknowledged"] <= acknowledged + in_flight
    assert info["scans_applied"] == info["last_sequence"] == info["revision"] == info["scans_acknowledged"]
    sequences = [sequence for uploader in uploaders for sequence in uploader.acknowledged.values()]
    assert len(set(sequences)) == len(sequences)
    assert max(sequences, default=0) <= info["last_sequence"]


def map_without_kills(uploaders: list[Uploader]) -> dict[tuple[int, ...], float]:
    """The same scans in the order of their sequences, inserted by the kernel alone."""
    scans = sorted(
        (sequence, numbered_scan(uploader.name, number)[2])
        for uploader in uploaders
        for number, sequence in uploader.acknowledged.items()
    )
    assert [sequence for sequence, _ in scans] == list(range(1, len(scans) + 1))
    occupancy_map = OccupancyMap(RESOLUTION_M)
    for _, seed in scans:
        occupancy_map.insert_scan(some_points(seed, 150))
    return leaf_dict(*occupancy_map.leaves())


def resend_all(url: str, uploaders: list[Uploader]) -> None:
    """Every acknowledged scan is known, under the sequence that was acknowledged; what was in flight is settled."""
    with httpx.Client(base_url=url, timeout=20) as http:
        for uploader in uploaders:
            known = len(uploader.acknowledged)
            for number in range(known + uploader.in_flight):
                scan_id, data, _ = numbered_scan(uploader.name, number)
                answer = put_scan(http, "lab", scan_id, data, wait="journaled").json()
                assert answer["duplicate"] or number >= known
                uploader.note(number, answer["sequence"])


@pytest.mark.timeout(300)
def test_no_acknowledged_scan_is_lost_or_doubled_by_fifty_kills(tmp_path: Path) -> None:
    address = Address()
    uploaders = [HttpUploader("first", address), HttpUploader("second", address), StreamUploader("stream", address)]
    with ServiceNursery(tmp_path, snapshot_every_bytes=200_000) as nursery:
        url = nursery.start()
        await_map_created(url)
        for uploader in uploaders:
            uploader.start()
        for kill in range(KILLS):
            address.set(url)
            # Every fifth kill comes while the maps are still being restored or the first scans arrive.
            time.sleep(random.uniform(0, 0.03 if kill % 5 == 0 else 0.4))
            address.set(None)
            nursery.kill()
            torn = kill % 3 == 0
            if torn:
                tear_a_record(tmp_path / "maps" / "lab")
            url = nursery.start()
            if kill % 5 != 4:
                info = await_map(url)
                assert info["journal_cut"] is not None or not torn
                assert_nothing_lost_or_doubled(info, uploaders)
        address.stop()
        for uploader in uploaders:
            uploader.join(30)
        assert_nothing_lost_or_doubled(await_map(url), uploaders)
        resend_all(url, uploaders)
        assert sum(len(uploader.acknowledged) for uploader in uploaders) > 10 * KILLS
        with httpx.Client(base_url=url, timeout=30) as http:
            http.post("/v1/maps/lab/points?min_revision=1", json={"points": [[0, 0, 0]]})
            await_applied(http, max(max(uploader.acknowledged.values()) for uploader in uploaders))
            assert served_leaves(http, "lab") == map_without_kills(uploaders)


def tear_a_record(directory: Path) -> None:
    """What a crash of the whole machine can leave: the first bytes of one more record."""
    segment = max(directory.glob("*.journal"))
    data = scan_frame(some_points(1))[1]
    record = record_header(10_000_000, data) + data
    with segment.open("ab") as file:
        file.write(record[: random.randint(1, len(record) - 1)])


def await_map_created(url: str) -> None:
    with httpx.Client(base_url=url, timeout=20) as http:
        create_map(http, "lab", RESOLUTION_M)


def await_applied(http: httpx.Client, sequence: int) -> None:
    deadline = time.monotonic() + 30
    while http.get("/v1/maps/lab").json()["applied_sequence"] < sequence:
        assert time.monotonic() < deadline
        time.sleep(0.01)
