"""When the client tries again, with a clock that nobody waits for."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rayvox_client import (
    AsyncClient,
    ConnectionFailedError,
    InvalidInputError,
    MapExistsError,
    NotFoundError,
    OverloadedError,
    RetryPolicy,
    ServiceError,
    UnavailableError,
)
from rayvox_client.errors import service_error
from rayvox_client.retry import parse_retry_after
from rayvox_client.transport import ByteStream, MessageStream


@given(st.integers(0, 2000), st.floats(0, 1, exclude_max=True))
def test_a_delay_lies_in_the_upper_half_of_a_doubling_step(retry: int, drawn: float) -> None:
    policy = RetryPolicy(first_delay_s=0.25, factor=2, max_delay_s=8, draw=lambda: drawn)
    step = min(8.0, 0.25 * 2.0 ** min(retry, 10))
    assert step / 2 <= policy.delay_s(retry) <= step


@given(st.floats(0, 60), st.floats(0, 1, exclude_max=True))
def test_no_delay_is_shorter_than_the_service_asked_for(retry_after_s: float, drawn: float) -> None:
    policy = RetryPolicy(draw=lambda: drawn)
    assert retry_after_s <= policy.delay_s(0, retry_after_s) <= retry_after_s + 0.1 * policy.first_delay_s


def test_attempts_end_after_the_retries() -> None:
    attempts = RetryPolicy(retries=2, draw=lambda: 1.0).start()
    failure = ConnectionFailedError("refused")
    assert [attempts.delay_after(failure), attempts.delay_after(failure)] == [0.25, 0.5]
    with pytest.raises(ConnectionFailedError, match="refused"):
        attempts.delay_after(failure)


@pytest.mark.parametrize("status", [400, 401, 403, 404, 405, 408, 409, 413, 415, 422, 500, 502, 504])
def test_no_other_answer_is_tried_again(status: int) -> None:
    with pytest.raises(ServiceError):
        RetryPolicy().start().delay_after(service_error(status, "", "no"))


def test_an_answer_after_a_lost_one_says_so() -> None:
    attempts = RetryPolicy().start()
    attempts.delay_after(ConnectionFailedError("lost"))
    with pytest.raises(MapExistsError) as error:
        attempts.delay_after(MapExistsError(409, "map-exists", "exists"))
    assert error.value.after_lost_answer
    with pytest.raises(NotFoundError) as first:
        RetryPolicy().start().delay_after(NotFoundError(404, "not-found", "no"))
    assert not first.value.after_lost_answer


@pytest.mark.parametrize(
    ("header", "seconds"),
    [
        ("2", 2.0),
        ("0.5", 0.5),
        ("-3", 0.0),
        ("Thu, 01 Jan 1970 00:02:00 GMT", 20.0),
        ("Thu, 01 Jan 1970 00:00:00 GMT", 0.0),
        ("soon", None),
        ("nan", None),
        ("inf", None),
        ("", None),
        (None, None),
    ],
)
def test_retry_after_is_seconds_or_a_date(header: str | None, seconds: float | None) -> None:
    assert parse_retry_after(header, now_s=lambda: 100.0) == seconds


def test_a_policy_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(InvalidInputError):
        RetryPolicy(retries=-1)
    with pytest.raises(InvalidInputError):
        RetryPolicy(factor=0.5)


class ScriptedTransport:
    """Fails to connect, or answers, as it is told; remembers for how long it was asked to sleep."""

    def __init__(self, answers: list[bytes | None]) -> None:
        self.answers = answers
        self.slept: list[float] = []

    async def connect(self) -> ByteStream:
        answer = self.answers.pop(0)
        if answer is None:
            raise ConnectionFailedError("refused")
        return ScriptedStream(answer)

    async def open_messages(self, target: str) -> MessageStream:
        raise ConnectionFailedError(target)

    async def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)


class ScriptedStream:
    def __init__(self, answer: bytes) -> None:
        self._answer = answer

    async def send(self, parts: object) -> None:
        pass

    async def receive(self) -> bytes:
        answer, self._answer = self._answer, b""
        return answer

    def is_stale(self) -> bool:
        return True

    def close(self) -> None:
        pass


OK = b'HTTP/1.1 200 OK\r\nContent-Length: 15\r\n\r\n{"status":"ok"}'
BUSY = b"HTTP/1.1 503 Busy\r\nRetry-After: 7\r\nContent-Length: 0\r\n\r\n"
LIMITED = b"HTTP/1.1 429 Slow\r\nContent-Length: 0\r\n\r\n"


def client_of(transport: ScriptedTransport, retries: int = 5) -> AsyncClient:
    return AsyncClient(retries=RetryPolicy(retries, draw=lambda: 0.0), transport=transport)


def test_the_client_sleeps_as_the_policy_says() -> None:
    transport = ScriptedTransport([None, BUSY, LIMITED, OK])
    assert asyncio.run(client_of(transport).health()) == "ok"
    assert transport.slept == pytest.approx([0.125, 7 + 0.1 * 0.25, 0.5])


def test_the_last_failure_is_raised_when_the_retries_are_used_up() -> None:
    with pytest.raises(UnavailableError) as error:
        asyncio.run(client_of(ScriptedTransport([None, BUSY]), retries=1).health())
    assert error.value.retry_after_s == 7.0
    assert isinstance(error.value, OverloadedError)
    with pytest.raises(ConnectionFailedError):
        asyncio.run(client_of(ScriptedTransport([None]), retries=0).health())


@pytest.mark.parametrize(
    "answer",
    [b"", b"HTTP/1.1 200 OK\r\nContent-Le", OK[:-1], b"SSH-2.0-OpenSSH\r\n\r\n", b"HTTP/1.1 100 Continue\r\n\r\n"],
    ids=["nothing", "half a head", "half a body", "not HTTP", "only interim"],
)
def test_half_an_answer_is_a_failed_connection(answer: bytes) -> None:
    transport = ScriptedTransport([answer, OK])
    assert asyncio.run(client_of(transport).health()) == "ok"
    assert len(transport.slept) == 1
