"""What the client needs from the outside world.

The client's logic is written once, as coroutines over this interface. `AsyncTransport` implements it on asyncio.
`BlockingTransport` implements it with calls that block and never suspend, so that `run_blocking` can drive the same
coroutines to their end without an event loop.
"""

from __future__ import annotations

from collections.abc import Coroutine, Sequence
from typing import Any, Protocol, TypeVar

from rayvox_client.errors import ConnectionFailedError
from rayvox_client.http_message import problem_error

T = TypeVar("T")

# Larger WebSocket messages go out in fragments: masking them then stays within the cache, twice as fast.
FRAGMENT_BYTES = 256 * 1024
# By then everything is acknowledged, or the connection is broken anyway: waiting for a polite goodbye gains nothing.
CLOSE_TIMEOUT_S = 1.0
_FATAL_CLOSE_CODES = {1003: "unsupported data", 1007: "invalid data", 1008: "policy violation", 1009: "too large"}


class ByteStream(Protocol):
    """A connected socket. Every method raises ConnectionFailedError when the connection breaks or time runs out."""

    async def send(self, parts: Sequence[bytes | memoryview]) -> None: ...

    async def receive(self) -> bytes:
        """The next bytes; empty at the end of the stream."""

    def is_stale(self) -> bool:
        """Whether an idle connection was closed, or sent something unasked."""

    def close(self) -> None: ...


class MessageStream(Protocol):
    """An open WebSocket. Every method raises ConnectionFailedError or StreamRefusedError when it breaks."""

    async def send(self, frame: bytes) -> None: ...

    async def receive(self, timeout_s: float | None) -> str | bytes | None:
        """The next message; None when none came within `timeout_s`."""

    async def close(self) -> None: ...


class Transport(Protocol):
    """Opens connections to one service, and sleeps."""

    async def connect(self) -> ByteStream: ...

    async def open_messages(self, target: str) -> MessageStream: ...

    async def sleep(self, seconds: float) -> None: ...


class StreamRefusedError(Exception):
    """The service closed the WebSocket for good: what was sent is at fault, sending it again would not help."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason


def run_blocking(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine that never suspends, because everything below it blocks."""
    try:
        coroutine.send(None)
    except StopIteration as stop:
        result: T = stop.value
        return result
    raise RuntimeError("a blocking transport suspended")


def fragments(frame: bytes) -> bytes | list[memoryview]:
    """The message as it is, or in fragments when it is large."""
    if len(frame) <= FRAGMENT_BYTES:
        return frame
    view = memoryview(frame)
    return [view[start : start + FRAGMENT_BYTES] for start in range(0, len(frame), FRAGMENT_BYTES)]


def websocket_error(error: Exception, where: str) -> Exception:
    """Our error for one of the websockets library's, or of the operating system's."""
    from websockets.exceptions import ConnectionClosed, InvalidStatus

    if isinstance(error, InvalidStatus):
        response = error.response
        return problem_error(response.status_code, bytes(response.body or b""), response.headers.get("Retry-After"))
    if isinstance(error, ConnectionClosed):
        code, reason = (error.rcvd.code, error.rcvd.reason) if error.rcvd else (1006, "connection lost")
        if code in _FATAL_CLOSE_CODES:
            return StreamRefusedError(code, reason or _FATAL_CLOSE_CODES[code])
        return ConnectionFailedError(f"the stream to {where} closed: {code} {reason}".rstrip())
    return ConnectionFailedError(f"the stream to {where} failed: {error or type(error).__name__}")
