"""The stream's bookkeeping, message by message."""

from __future__ import annotations

import json

import pytest
from rayvox_client import InvalidInputError, MalformedAnswerError, MapNotFoundError, OutOfRangeError, OverloadedError
from rayvox_client.fields import Fields
from rayvox_client.stream_state import StreamState


def opened(max_in_flight: int) -> Fields:
    return Fields({"type": "opened", "max_in_flight": max_in_flight, "revision": 0, "last_sequence": 0}, "test")


def ack(scan_id: str, sequence: int, duplicate: bool = False) -> str:
    return json.dumps({"type": "ack", "scan_id": scan_id, "sequence": sequence, "duplicate": duplicate})


def refusal(scan_id: str | None, slug: str, status: int) -> str:
    problem = {"type": f"urn:rayvox:problem:{slug}", "title": slug, "status": status, "detail": "because"}
    return json.dumps({"type": "error", "scan_id": scan_id, "problem": problem})


@pytest.fixture
def state() -> StreamState:
    fresh = StreamState()
    fresh.on_opened(opened(2))
    for name in ("a", "b"):
        fresh.add(name, name.encode())
    assert list(fresh.due()) == [b"a", b"b"]
    return fresh


def test_there_is_room_only_below_what_the_service_allows(state: StreamState) -> None:
    assert not state.has_room
    state.on_message(ack("a", 1))
    assert state.has_room
    assert state.unacknowledged == ("b",)


def test_a_sent_scan_is_not_due_again_until_the_stream_is_opened_anew(state: StreamState) -> None:
    assert list(state.due()) == []
    state.on_message(ack("a", 1))
    state.on_opened(opened(2))
    assert list(state.due()) == [b"b"]


def test_a_scan_whose_sending_broke_off_stays_due() -> None:
    state = StreamState()
    state.add("a", b"a")
    next(state.due())
    assert list(state.due()) == [b"a"]


def test_an_acknowledgement_counts_once(state: StreamState) -> None:
    state.on_message(ack("a", 5))
    state.on_message(ack("a", 5, duplicate=True))
    state.on_message(ack("b", 3, duplicate=True))
    assert (state.acknowledged, state.duplicates, state.last_sequence) == (2, 1, 5)
    assert [taken.scan_id for taken in state.acks] == ["a", "b"]


def test_an_overloaded_service_makes_the_scan_due_again(state: StreamState) -> None:
    with pytest.raises(OverloadedError):
        state.on_message(refusal("a", "overloaded", 429))
    assert list(state.due()) == [b"a"]
    assert state.refused == []


def test_a_refused_scan_is_reported_once(state: StreamState) -> None:
    state.on_message(refusal("a", "out-of-range", 422))
    state.on_message(refusal("a", "out-of-range", 422))
    assert state.unacknowledged == ("b",)
    with pytest.raises(OutOfRangeError, match="because"):
        state.raise_for_refused()
    state.raise_for_refused()


def test_an_error_without_a_scan_is_the_streams(state: StreamState) -> None:
    with pytest.raises(MapNotFoundError):
        state.on_message(refusal(None, "map-not-found", 404))
    assert state.unacknowledged == ("a", "b")


def test_a_scan_in_flight_cannot_be_added_again(state: StreamState) -> None:
    with pytest.raises(InvalidInputError, match="in flight"):
        state.add("a", b"other")


@pytest.mark.parametrize(
    "message", ["", "[]", "{}", '{"type":"hello"}', '{"type":"ack","scan_id":"a"}', '{"type":"error"}', b"RVX1", b""]
)
def test_a_message_that_the_api_does_not_know_is_refused(state: StreamState, message: str | bytes) -> None:
    with pytest.raises(MalformedAnswerError):
        state.on_message(message)
    assert state.unacknowledged == ("a", "b")
