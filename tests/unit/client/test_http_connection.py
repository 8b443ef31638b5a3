from __future__ import annotations

import itertools

import httptools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import ConnectionFailedError, InvalidInputError
from rayvox_client.frame import decode_frame
from rayvox_client.http_connection import HttpConnection
from rayvox_client.http_message import HttpRequest
from rayvox_client.scan import Scan
from rayvox_client.transport import run_blocking

ANNOUNCED = b"HTTP/1.1 200 OK\r\nContent-Type: a/b\r\nContent-Length: 10\r\n\r\n0123456789"
CHUNKED = (
    b"HTTP/1.1 200 OK\r\ncontent-type: a/b\r\nTransfer-Encoding: chunked\r\n\r\n4\r\n0123\r\n6\r\n456789\r\n0\r\n\r\n"
)
UNTIL_CLOSED = b"HTTP/1.1 200 OK\r\nContent-Type: a/b\r\n\r\n0123456789"
INFORMED = b"HTTP/1.1 103 Early Hints\r\nLink: x\r\n\r\nHTTP/1.1 100 Continue\r\n\r\n" + ANNOUNCED
EMPTY = b"HTTP/1.1 204 No Content\r\nDate: today\r\n\r\n"


class Script:
    """A `ByteStream` that plays what is to arrive and keeps what is sent."""

    def __init__(self, *incoming: bytes) -> None:
        self.incoming = list(incoming)
        self.sent: list[bytes] = []

    async def send(self, parts: list[bytes | memoryview]) -> None:
        self.sent.append(b"".join(parts))

    async def receive(self) -> bytes:
        return self.incoming.pop(0) if self.incoming else b""

    def is_stale(self) -> bool:
        return False

    def close(self) -> None:
        return None


def connection(*incoming: bytes, api_key: str | None = None) -> tuple[HttpConnection, Script]:
    script = Script(*incoming)
    return HttpConnection(script, Endpoint.parse("http://robot:81/base", api_key)), script


@given(st.sampled_from([ANNOUNCED, CHUNKED, UNTIL_CLOSED, INFORMED]), st.lists(st.integers(0, 200), max_size=8))
def test_an_answer_is_the_same_however_it_is_cut(answer: bytes, cuts: list[int]) -> None:
    places = sorted({0, len(answer), *(cut for cut in cuts if cut < len(answer))})
    pieces = [answer[start:end] for start, end in itertools.pairwise(places)]
    http, _ = connection(*pieces)
    response = run_blocking(http.exchange(HttpRequest("GET", "/")))
    assert (response.status, response.body, response.headers["content-type"]) == (200, b"0123456789", "a/b")
    assert "link" not in response.headers
    assert http.is_reusable == (answer is not UNTIL_CLOSED)


def test_an_answer_without_a_body_is_complete_with_its_head() -> None:
    http, _ = connection(EMPTY)
    response = run_blocking(http.exchange(HttpRequest("DELETE", "/")))
    assert (response.status, response.body) == (204, b"")
    assert http.is_reusable


@pytest.mark.parametrize(
    "incoming", [b"", b"HTTP/1.1 200 OK\r\nContent-Le", ANNOUNCED[:-1], CHUNKED[:-3], INFORMED[:70], b"SSH-2.0-x\r\n"]
)
def test_what_is_no_whole_answer_is_a_failed_connection(incoming: bytes) -> None:
    http, _ = connection(incoming)
    with pytest.raises(ConnectionFailedError, match="broke off its answer"):
        run_blocking(http.exchange(HttpRequest("GET", "/")))
    assert not http.is_reusable


@pytest.mark.parametrize("surplus", [ANNOUNCED, b"HTTP/1.1 2"])
def test_a_connection_with_more_than_was_asked_for_is_not_used_again(surplus: bytes) -> None:
    http, _ = connection(ANNOUNCED + surplus)
    assert run_blocking(http.exchange(HttpRequest("GET", "/"))).body == b"0123456789"
    assert not http.is_reusable


def test_an_answer_that_closes_ends_the_connection() -> None:
    http, _ = connection(ANNOUNCED.replace(b"Content-Type", b"Connection: close\r\nContent-Type"))
    run_blocking(http.exchange(HttpRequest("GET", "/")))
    assert not http.is_reusable


def test_a_request_is_what_http_says() -> None:
    http, script = connection(ANNOUNCED, api_key="secret")
    run_blocking(http.exchange(HttpRequest("POST", "/base/v1/maps?a=b", b"{}", "application/json")))
    requests: list[tuple[bytes, bytes]] = []

    class Reader:
        def on_header(self, name: bytes, value: bytes) -> None:
            requests.append((name.lower(), value))

        def on_body(self, body: bytes) -> None:
            requests.append((b"body", body))

    parser = httptools.HttpRequestParser(Reader())
    parser.feed_data(b"".join(script.sent))
    assert parser.get_method() == b"POST"
    assert (
        dict(requests).items()
        >= {
            b"host": b"robot:81",
            b"authorization": b"Bearer secret",
            b"content-type": b"application/json",
            b"content-length": b"2",
            b"body": b"{}",
        }.items()
    )


def test_a_scan_goes_out_head_first_and_its_points_uncopied() -> None:
    points = np.ones((1000, 3), np.float32)
    frame = Scan(points).lay_out_frame()
    http, script = connection(ANNOUNCED)
    run_blocking(http.exchange(HttpRequest("PUT", "/", frame)))
    head, body = script.sent
    assert head.endswith(f"Content-Length: {len(body)}\r\n\r\n".encode())
    np.testing.assert_array_equal(decode_frame(body).payloads["points"], points)
    assert np.shares_memory(np.asarray(frame.parts()[-1]), points)


@pytest.mark.parametrize("url", ["http://a b", "http://a/b c", "http://a/\r\nX-Header: 1", "http://ä"])
def test_an_address_cannot_carry_anything_into_the_request(url: str) -> None:
    with pytest.raises(InvalidInputError, match="printable ASCII"):
        Endpoint.parse(url, None)
