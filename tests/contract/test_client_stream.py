"""The scan stream against a service that cuts, refuses and forgets to answer."""

from __future__ import annotations

import asyncio
import json
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox_client import (
    AsyncClient,
    Client,
    ConnectionFailedError,
    InvalidInputError,
    MapCopy,
    MapNotFoundError,
    OutOfRangeError,
    RefusedInputError,
    RetryPolicy,
    Scan,
    TooLargeError,
)
from rayvox_client.frame import encode_frame

from tests.support.loopback_service import LoopbackService, problem

POINTS = np.arange(300_000, dtype=np.float32).reshape(-1, 3)
SMALL = POINTS[:10]
QUICK = RetryPolicy(retries=3, first_delay_s=0.001)


@pytest.fixture
def service() -> Iterator[LoopbackService]:
    with LoopbackService() as running:
        running.add_map("lab")
        yield running


@pytest.fixture
def client(service: LoopbackService) -> Client:
    return Client(service.url, retries=QUICK, timeout_s=5)


Push = Callable[[LoopbackService, int], list[str]]


def push_blocking(service: LoopbackService, count: int) -> list[str]:
    with Client(service.url, retries=QUICK, timeout_s=5).stream("lab") as stream:
        pushed = [stream.push(POINTS) for _ in range(count)]
    assert stream.unacknowledged == ()
    assert stream.acknowledged == count
    return pushed


def push_async(service: LoopbackService, count: int) -> list[str]:
    async def push() -> list[str]:
        async with (
            AsyncClient(service.url, retries=QUICK, timeout_s=5) as client,
            client.stream("lab") as stream,
        ):
            pushed = [await stream.push(POINTS) for _ in range(count)]
        assert stream.unacknowledged == ()
        assert stream.acknowledged == count
        return pushed

    return asyncio.run(push())


both = pytest.mark.parametrize("push", [push_blocking, push_async], ids=["blocking", "async"])


@both
def test_every_scan_arrives_in_order(service: LoopbackService, push: Push) -> None:
    pushed = push(service, 12)
    assert list(service.scans["lab"]) == pushed


@both
def test_no_more_scans_are_in_flight_than_the_service_allows(service: LoopbackService, push: Push) -> None:
    service.hold_acks = True
    pushed = push(service, 12)
    assert list(service.scans["lab"]) == pushed
    assert service.most_in_flight == service.max_in_flight


@both
def test_cut_connections_and_lost_acknowledgements_lose_and_double_nothing(
    service: LoopbackService, push: Push
) -> None:
    service.stream_faults.drop_after_scans.extend([1, 3, 2])
    pushed = push(service, 10)
    assert sorted(service.scans["lab"]) == sorted(pushed)
    assert service.connections == 4


@both
def test_acknowledgements_between_the_cuts_renew_the_patience(service: LoopbackService, push: Push) -> None:
    service.stream_faults.drop_after_scans.extend([2] * (QUICK.retries + 3))
    pushed = push(service, 12)
    assert sorted(service.scans["lab"]) == sorted(pushed)


def test_a_connection_cut_at_every_attempt_raises_and_keeps_the_scans(service: LoopbackService, client: Client) -> None:
    service.stream_faults.drop_after_scans.extend([1] * 4)
    stream = client.stream("lab")
    stream.open()
    pushed = stream.push(SMALL)
    with pytest.raises(ConnectionFailedError):
        stream.flush()
    assert stream.unacknowledged == (pushed,)
    stream.flush()
    assert not stream.unacknowledged
    assert stream.duplicates == 1
    stream.close()


def test_a_refused_scan_raises_its_typed_error_at_flush_and_the_others_go_on(
    service: LoopbackService, client: Client
) -> None:
    bad = str(uuid.uuid4())
    refusal = json.loads(problem("out-of-range", 422, "points[3] is too far away"))
    service.stream_faults.problems[bad] = deque_of(refusal)
    stream = client.stream("lab")
    stream.open()
    first, _, last = stream.push(SMALL), stream.push(SMALL, scan_id=bad), stream.push(SMALL)
    with pytest.raises(OutOfRangeError, match="too far away") as error:
        stream.flush()
    assert bad in error.value.__notes__[0]
    assert list(service.scans["lab"]) == [first, last]
    stream.flush()
    stream.close()


def test_an_overloaded_service_gets_the_scan_again_later(service: LoopbackService, client: Client) -> None:
    slow = str(uuid.uuid4())
    overloaded = json.loads(problem("overloaded", 429, "queue full"))
    service.stream_faults.problems[slow] = deque_of(overloaded, overloaded)
    with client.stream("lab") as stream:
        stream.push(SMALL, scan_id=slow)
        stream.push(SMALL)
    assert slow in service.scans["lab"]
    assert len(service.scans["lab"]) == 2
    assert service.connections == 1


@pytest.mark.parametrize(("code", "error_type"), [(1009, TooLargeError), (1007, RefusedInputError)])
def test_a_stream_closed_for_good_is_not_opened_again(
    service: LoopbackService, client: Client, code: int, error_type: type[Exception]
) -> None:
    service.stream_faults.close_codes.append(code)
    with pytest.raises(error_type, match="told to"), client.stream("lab") as stream:
        stream.push(SMALL)
    assert service.connections == 1


def test_a_stream_closed_for_a_restart_is_opened_again(service: LoopbackService, client: Client) -> None:
    service.stream_faults.close_codes.append(1012)
    with client.stream("lab") as stream:
        stream.push(SMALL)
    assert len(service.scans["lab"]) == 1
    assert service.connections == 2


def test_a_missing_map_shows_when_the_stream_is_opened(client: Client) -> None:
    with pytest.raises(MapNotFoundError, match="no such map"), client.stream("nowhere"):
        pass


def test_bad_points_are_refused_before_anything_is_sent(service: LoopbackService, client: Client) -> None:
    with client.stream("lab") as stream:
        with pytest.raises(InvalidInputError, match=r"points\[1\] = \[nan, 1.0, 2.0\]"):
            stream.push([[0.0, 0.0, 0.0], [np.nan, 1.0, 2.0]])
        assert stream.unacknowledged == ()
    assert service.scans["lab"] == {}


def test_the_same_scan_cannot_be_in_flight_twice(service: LoopbackService, client: Client) -> None:
    service.hold_acks = True
    scan = Scan(SMALL)
    stream = client.stream("lab")
    stream.open()
    stream.push_scan(scan)
    with pytest.raises(InvalidInputError, match="in flight"):
        stream.push_scan(scan)
    stream.close()


def test_leaving_the_block_by_an_error_does_not_wait_for_acknowledgements(
    service: LoopbackService, client: Client
) -> None:
    service.hold_acks = True
    stream = client.stream("lab")

    def fail() -> None:
        with stream:
            stream.push(SMALL)
            raise KeyError("robot")

    with pytest.raises(KeyError):
        fail()
    assert len(stream.unacknowledged) == 1


def change(since: int, revision: int) -> bytes:
    fields = {"since": since, "revision": revision, "full": since == 0, "resolution_m": 0.05, "depth": 16}
    keys = np.array([[revision, 0, 0]], np.int32)
    depth, log_odds = np.full(1, 16, np.uint8), np.full(1, revision, np.float32)
    payloads: dict[str, NDArray[Any]] = {
        "region_keys": keys,
        "region_depth": depth,
        "keys": keys,
        "leaf_depth": depth,
        "log_odds": log_odds,
    }
    return encode_frame("changes", fields, payloads)


def test_a_subscriber_follows_the_map(service: LoopbackService, client: Client) -> None:
    service.changes.extend([change(0, 1), change(1, 4)])
    copy = MapCopy()
    with client.subscribe("lab") as changes:
        for received in changes:
            received.apply_to(copy)
            if copy.revision == 4:
                break
    assert copy.keys.tolist() == [[1, 0, 0], [4, 0, 0]]
    assert service.seen[-1].target == "/v1/maps/lab/stream?subscribe=true&since=0"


def test_a_subscriber_takes_up_after_a_cut_where_it_was(service: LoopbackService, client: Client) -> None:
    service.changes.append(change(0, 3))
    service.stream_faults.drop_after_scans.append(1)
    with client.stream("lab", subscribe=True, since=0) as stream:
        stream.push(SMALL)
        stream.flush()
        received = stream.next_change(timeout_s=0)
        assert received is not None
        assert received.revision == 3
        assert stream.next_change(timeout_s=0) is None
    assert service.seen[-1].target == "/v1/maps/lab/stream?subscribe=true&since=3"


def test_an_async_subscriber_follows_the_map(service: LoopbackService) -> None:
    service.changes.extend([change(0, 1), change(1, 4)])

    async def follow() -> MapCopy:
        copy = MapCopy()
        async with AsyncClient(service.url).subscribe("lab") as changes:
            async for received in changes:
                received.apply_to(copy)
                if copy.revision == 4:
                    break
        return copy

    assert len(asyncio.run(follow())) == 2


def deque_of(*items: dict[str, object]) -> deque[dict[str, object]]:
    return deque(items)
