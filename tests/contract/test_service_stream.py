from __future__ import annotations

import json
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from rayvox import OccupancyMap
from rayvox_service.frame import UNLIMITED, Frame, decode_frame
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from tests.support.service_process import (
    ServiceProcess,
    create_map,
    leaf_dict,
    put_scan,
    scan_frame,
    served_leaves,
    some_points,
)


def open_stream(url: str, name: str, query: str = "", **options: Any) -> ClientConnection:
    address = f"{url.replace('http', 'ws')}/v1/maps/{name}/stream{query}"
    stream: ClientConnection = connect(address, compression=None, max_size=None, open_timeout=20, **options)
    return stream


def send_all(stream: ClientConnection, scans: list[tuple[uuid.UUID, bytes]]) -> threading.Thread:
    """Sends in a thread of its own, as a sender that does not wait for answers would."""

    def run() -> None:
        for _, data in scans:
            stream.send(data)

    sender = threading.Thread(target=run, daemon=True)
    sender.start()
    return sender


def told(stream: ClientConnection) -> dict[str, Any]:
    """The next text message."""
    message = stream.recv(timeout=20)
    assert isinstance(message, str)
    document: dict[str, Any] = json.loads(message)
    return document


def change(stream: ClientConnection) -> Frame:
    """The next change, acknowledgements skipped."""
    while isinstance(message := stream.recv(timeout=20), str):
        pass
    return decode_frame(message, UNLIMITED)


class Copy:
    """A subscriber's copy of the leaves, kept by docs/frame.md's rule alone."""

    def __init__(self) -> None:
        self.revision = 0
        self.leaves: dict[tuple[int, ...], float] = {}
        self.frames = 0

    def apply(self, frame: Frame) -> None:
        assert frame.fields["full"] or frame.fields["since"] == self.revision
        if frame.fields["full"]:
            self.leaves.clear()
        levels = frame.fields["depth"]
        keys, depths = frame.array("region_keys").tolist(), frame.array("region_depth").tolist()
        regions = {(levels - depth, *key) for key, depth in zip(keys, depths, strict=True)}
        for shift in {region[0] for region in regions}:
            # A region's key is its lowest cell, so what lies inside has that key once its low bits are cleared.
            self.leaves = {
                leaf: value
                for leaf, value in self.leaves.items()
                if (shift, *(cell >> shift << shift for cell in leaf[:3])) not in regions
            }
        self.leaves |= leaf_dict(frame.array("keys"), frame.array("leaf_depth"), frame.array("log_odds"))
        self.revision = frame.fields["revision"]
        self.frames += 1


def expected(seeds: Any) -> dict[tuple[int, ...], float]:
    occupancy_map = OccupancyMap(0.25)
    for seed in seeds:
        occupancy_map.insert_scan(some_points(seed))
    return leaf_dict(*occupancy_map.leaves())


def test_the_first_message_says_where_the_map_stands(service: ServiceProcess, lab: str) -> None:
    put_scan(service.http, lab, *scan_frame(some_points()))
    with open_stream(service.url, lab) as stream:
        assert told(stream) == {"type": "opened", "max_in_flight": 8, "revision": 1, "last_sequence": 1}


def test_every_scan_is_acknowledged_once_in_the_order_it_was_sent(service: ServiceProcess, lab: str) -> None:
    scans = [scan_frame(some_points(seed)) for seed in range(30)]
    with open_stream(service.url, lab) as stream:
        told(stream)
        sender = send_all(stream, scans)
        acks = [told(stream) for _ in scans]
        sender.join()
    assert acks == [
        {"type": "ack", "scan_id": str(scan_id), "sequence": sequence, "duplicate": False}
        for sequence, (scan_id, _) in enumerate(scans, 1)
    ]
    service.http.post(f"/v1/maps/{lab}/points?min_revision=30", json={"points": [[0, 0, 0]]})
    assert served_leaves(service.http, lab) == expected(range(30))


def test_a_bad_scan_is_answered_in_its_place_and_the_stream_goes_on(service: ServiceProcess, lab: str) -> None:
    first, bad, last = scan_frame(some_points(1)), scan_frame(np.full((3, 3), np.nan)), scan_frame(some_points(2))
    with open_stream(service.url, lab) as stream:
        told(stream)
        for _, data in (first, bad, first, last):
            stream.send(data)
        answers = [told(stream) for _ in range(4)]
    assert [answer["type"] for answer in answers] == ["ack", "error", "ack", "ack"]
    assert answers[1]["scan_id"] == str(bad[0])
    problem = answers[1]["problem"]
    assert problem["type"] == "urn:rayvox:problem:invalid-input"
    assert problem["status"] == 422
    assert problem["instance"] == f"/v1/maps/{lab}/stream"
    assert [answer.get("duplicate") for answer in answers] == [False, None, True, False]
    assert [answer.get("sequence") for answer in answers] == [1, None, 1, 2]


def test_a_broken_frame_is_named_and_closes_the_stream(service: ServiceProcess, lab: str) -> None:
    good, (_, data) = scan_frame(some_points(1)), scan_frame(some_points(2))
    with open_stream(service.url, lab) as stream:
        told(stream)
        stream.send(good[1])
        stream.send(data[:-1])
        assert told(stream)["scan_id"] == str(good[0])
        answer = told(stream)
        assert (answer["type"], answer["scan_id"]) == ("error", None)
        assert answer["problem"]["type"] == "urn:rayvox:problem:invalid-frame"
        with pytest.raises(ConnectionClosed) as closed:
            stream.recv(timeout=20)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1007
    assert service.http.get(f"/v1/maps/{lab}").json()["scans_acknowledged"] == 1


def test_a_text_message_is_refused(service: ServiceProcess, lab: str) -> None:
    with open_stream(service.url, lab) as stream:
        told(stream)
        stream.send("hello")
        assert told(stream)["problem"]["type"] == "urn:rayvox:problem:invalid-frame"
        with pytest.raises(ConnectionClosed) as closed:
            stream.recv(timeout=20)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008


def test_a_stream_to_no_map_is_refused_with_a_problem_before_it_opens(service: ServiceProcess) -> None:
    with pytest.raises(InvalidStatus) as refused:
        open_stream(service.url, "none").close()
    response = refused.value.response
    assert response.status_code == 404
    assert response.headers["content-type"] == "application/problem+json"
    assert json.loads(response.body or b"")["type"] == "urn:rayvox:problem:map-not-found"


@pytest.mark.parametrize("query", ["?subscribe=maybe", "?subscribe=true&since=-1", "?since=x"])
def test_a_stream_with_senseless_parameters_is_refused(service: ServiceProcess, lab: str, query: str) -> None:
    with pytest.raises(InvalidStatus) as refused:
        open_stream(service.url, lab, query).close()
    assert json.loads(refused.value.response.body or b"")["type"] == "urn:rayvox:problem:invalid-input"


def test_a_stream_needs_the_key_where_there_is_one(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path, api_key="open sesame") as guarded:
        key = {"Authorization": "Bearer open sesame"}
        guarded.http.headers.update(key)
        create_map(guarded.await_ready().http, "lab")
        with pytest.raises(InvalidStatus) as refused:
            open_stream(guarded.url, "lab").close()
        assert refused.value.response.status_code == 401
        with open_stream(guarded.url, "lab", additional_headers=key) as stream:
            assert told(stream)["type"] == "opened"


def test_a_broken_stream_is_resumed_by_sending_again_what_was_not_acknowledged(
    service: ServiceProcess, lab: str
) -> None:
    scans = [scan_frame(some_points(seed)) for seed in range(12)]
    acknowledged: list[str] = []
    for attempt in range(6):
        stream = open_stream(service.url, lab)
        told(stream)
        rest = scans[len(acknowledged) :]
        for _, data in rest[:6]:
            stream.send(data)
        for _ in rest[: 2 if attempt < 5 else len(rest)]:
            acknowledged.append(told(stream)["scan_id"])
        # Gone without a word: what was in flight is in the journal or not, the sender cannot know.
        stream.socket.close()
    assert acknowledged == [str(scan_id) for scan_id, _ in scans]
    service.http.post(f"/v1/maps/{lab}/points?min_revision=12", json={"points": [[0, 0, 0]]})
    info = service.http.get(f"/v1/maps/{lab}").json()
    assert info["scans_acknowledged"] == info["last_sequence"] == 12
    assert served_leaves(service.http, lab) == expected(range(12))


def test_a_sender_that_reads_no_acknowledgements_is_held_back_not_buffered(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path, max_in_flight=2, queue_bytes=200_000) as service:
        create_map(service.await_ready().http, "lab")
        scans = [scan_frame(some_points(seed, count=2000)) for seed in range(60)]
        with open_stream(service.url, "lab") as stream:
            assert told(stream)["max_in_flight"] == 2
            sender = send_all(stream, scans)
            acks = [told(stream)["scan_id"] for _ in scans]
            sender.join()
        assert acks == [str(scan_id) for scan_id, _ in scans]


def test_a_subscriber_follows_the_map_to_its_last_leaf(service: ServiceProcess, lab: str) -> None:
    put_scan(service.http, lab, *scan_frame(some_points(0)))
    copy = Copy()
    with open_stream(service.url, lab, "?subscribe=true") as stream:
        told(stream)
        for seed in range(1, 8):
            put_scan(service.http, lab, *scan_frame(some_points(seed)), wait="journaled")
        service.http.post(f"/v1/maps/{lab}/clear", json={"lo": [0, 0, 0], "hi": [3, 3, 3]})
        while copy.revision < 9:
            copy.apply(change(stream))
    assert copy.leaves == served_leaves(service.http, lab)
    assert copy.leaves


def test_a_subscriber_that_comes_back_gets_only_what_it_missed(service: ServiceProcess, lab: str) -> None:
    put_scan(service.http, lab, *scan_frame(some_points(0, count=2000)))
    copy = Copy()
    with open_stream(service.url, lab, "?subscribe=true") as stream:
        copy.apply(change(stream))
    put_scan(service.http, lab, *scan_frame(np.array([[0.1, 0.1, 0.1]], "<f4")))
    with open_stream(service.url, lab, f"?subscribe=true&since={copy.revision}") as stream:
        missed = change(stream)
    copy.apply(missed)
    assert not missed.fields["full"]
    assert len(missed.array("keys")) < len(copy.leaves) / 2
    assert copy.leaves == served_leaves(service.http, lab)


@pytest.mark.parametrize("since", [2, 50])
def test_a_subscriber_from_before_a_restart_is_resynchronised(tmp_path: Path, since: int) -> None:
    with ServiceProcess(tmp_path) as service:
        create_map(service.await_ready().http, "lab")
        for seed in range(3):
            put_scan(service.http, "lab", *scan_frame(some_points(seed)))
        service.kill()
    with (
        ServiceProcess(tmp_path) as service,
        open_stream(service.await_ready().url, "lab", f"?subscribe=true&since={since}") as stream,
    ):
        told(stream)
        put_scan(service.http, "lab", *scan_frame(some_points(3)))
        copy = Copy()
        copy.revision = since
        copy.leaves = {} if since == 50 else expected(range(since))
        while copy.revision != 4:
            copy.apply(change(stream))
        assert copy.leaves == expected(range(4))


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[ServiceProcess]:
    with ServiceProcess(tmp_path) as service:
        create_map(service.await_ready().http, "lab", 0.1)
        yield service


def test_a_subscriber_that_does_not_read_slows_no_scan_and_gets_one_larger_change(busy: ServiceProcess) -> None:
    address = httpx.URL(busy.url)
    narrow = socket.socket()
    narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    narrow.connect((address.host, address.port))
    with open_stream(busy.url, "lab", "?subscribe=true", max_queue=1, sock=narrow) as lagging:
        told(lagging)
        for seed in range(30):
            response = put_scan(busy.http, "lab", *scan_frame(some_points(seed, count=1000)))
            assert response.json()["revision"] == seed + 1
        copy = Copy()
        while copy.revision < 30:
            copy.apply(change(lagging))
        # Coalesced: together the changes are more than the sockets hold, so they cannot all have been sent one by one.
        assert copy.frames < 30
    assert copy.leaves == served_leaves(busy.http, "lab")


def test_streams_end_when_their_map_is_deleted(service: ServiceProcess, lab: str) -> None:
    with open_stream(service.url, lab, "?subscribe=true") as stream:
        told(stream)
        assert service.http.delete(f"/v1/maps/{lab}").status_code == 204
        answer = told(stream)
        assert answer["problem"]["type"] == "urn:rayvox:problem:map-not-found"
        with pytest.raises(ConnectionClosed):
            stream.recv(timeout=20)


def test_a_stream_does_not_hold_up_the_services_stop(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path) as service:
        create_map(service.await_ready().http, "lab")
        with open_stream(service.url, "lab", "?subscribe=true") as stream:
            told(stream)
            started = time.monotonic()
            service.stop()
            with pytest.raises(ConnectionClosed):
                stream.recv(timeout=20)
            # The graceful wait is ten seconds; the process itself is given thirty by stop().
            assert service.process.returncode is not None
            assert time.monotonic() - started < 30
