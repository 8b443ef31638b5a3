"""The scan stream, for asyncio; also the one place where the stream's behaviour is written down."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Self, Unpack

from numpy.typing import ArrayLike

from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import (
    ConnectionFailedError,
    MalformedAnswerError,
    OverloadedError,
    RayvoxClientError,
    RefusedInputError,
    TooLargeError,
)
from rayvox_client.fields import Fields
from rayvox_client.frame import Compression
from rayvox_client.map_changes import MapChanges
from rayvox_client.receipt import RefusedScan, ScanAck
from rayvox_client.retry import RetryPolicy
from rayvox_client.scan import PosedScan, Scan, ScanOptions
from rayvox_client.stream_state import StreamState
from rayvox_client.transport import MessageStream, StreamRefusedError, Transport

TOO_LARGE_CLOSE_CODE = 1009


class AsyncScanStream:
    """Scans into one map over a WebSocket, each acknowledged once it is on the service's disk.

    A broken connection is opened again and everything unacknowledged is sent again under its scan_id, so that nothing
    is lost or doubled. One task at a time.
    """

    def __init__(
        self,
        transport: Transport,
        endpoint: Endpoint,
        policy: RetryPolicy,
        timeout_s: float,
        map_name: str,
        subscribe: bool,
        since: int | None,
        compression: Compression,
    ) -> None:
        self._transport = transport
        self._endpoint = endpoint
        self._policy = policy
        self._timeout_s = timeout_s
        self._map_name = map_name
        self._subscribe = subscribe
        self._compression = compression
        self._state = StreamState(since)
        self._socket: MessageStream | None = None
        self._attempts = policy.start()
        self._target(None)

    def _target(self, since: int | None) -> str:
        subscription = {"subscribe": True, "since": since} if self._subscribe else {}
        return self._endpoint.map_target(self._map_name, "stream", **subscription)

    async def push(
        self, points: ArrayLike, T_map_sensor: ArrayLike | None = None, **options: Unpack[ScanOptions]
    ) -> str:
        """Send one scan and return its scan_id; see `ScanStream.push`."""
        return await self.push_scan(Scan(points, T_map_sensor, **options))

    async def push_scan(self, scan: PosedScan) -> str:
        """Send a `Scan` or `DepthScan` and return its scan_id; see `ScanStream.push`."""
        frame = scan.to_frame(self._compression)
        await self._run_until(lambda: self._state.has_room)
        self._state.add(scan.scan_id, frame)
        await self._run_until(lambda: True)
        return scan.scan_id

    async def flush(self) -> None:
        """Wait until every scan is acknowledged or refused; see `ScanStream.flush`."""
        await self.settle()
        self._state.raise_for_refused()

    async def settle(self) -> None:
        """Wait until every scan is acknowledged or refused, without raising for the refused ones."""
        await self._run_until(lambda: self._state.in_flight == 0)

    async def next_change(self, timeout_s: float | None = None) -> MapChanges | None:
        """The next change of the map, None when none came within `timeout_s`; see `ScanStream.next_change`."""
        changes = self._state.changes
        await self._run_until(lambda: bool(changes), timeout_s, waits_for_service=False)
        return changes.popleft() if changes else None

    async def _run_until(
        self, done: Callable[[], bool], timeout_s: float | None = None, waits_for_service: bool = True
    ) -> None:
        """Send what is due and take what arrives until `done`, through broken connections.

        With `waits_for_service` silence for the client's timeout counts as a broken connection; otherwise silence
        for `timeout_s` is an answer.
        """
        while True:
            try:
                socket = await self._open()
                for frame in self._state.due():
                    await socket.send(frame)
                finished = done()
                wait_s = 0.0 if finished else self._timeout_s if waits_for_service else timeout_s
                message = await socket.receive(wait_s)
                if message is not None:
                    self._state.on_message(message)
                    self._attempts = self._policy.start()
                elif finished or not waits_for_service:
                    return
                else:
                    raise ConnectionFailedError(f"no acknowledgement from {self._endpoint.url} in {wait_s} s")
            except OverloadedError as error:
                await self._transport.sleep(self._attempts.delay_after(error))
            except ConnectionFailedError as error:
                await self._take_what_arrived()
                await self._drop()
                await self._transport.sleep(self._attempts.delay_after(error))
            except StreamRefusedError as error:
                await self._drop()
                raise self._refusal(error) from error
            except RayvoxClientError:
                await self._drop()
                raise

    async def _take_what_arrived(self) -> None:
        # A send may be the first to notice the break, while acknowledgements are still unread: progress all the same.
        with suppress(RayvoxClientError):
            while self._socket is not None and (message := await self._socket.receive(0.0)) is not None:
                self._state.on_message(message)
                self._attempts = self._policy.start()

    @staticmethod
    def _refusal(error: StreamRefusedError) -> RayvoxClientError:
        detail = f"the service closed the stream: {error.reason}"
        if error.code == TOO_LARGE_CLOSE_CODE:
            return TooLargeError(413, "too-large", detail)
        return RefusedInputError(400, "", detail)

    async def _open(self) -> MessageStream:
        if self._socket is None:
            socket = await self._transport.open_messages(self._target(self._state.since))
            self._socket = socket
            greeting = await socket.receive(self._timeout_s)
            if greeting is None:
                raise ConnectionFailedError(f"{self._endpoint.url} opened the stream and said nothing")
            self._greet(greeting)
        return self._socket

    def _greet(self, greeting: str | bytes) -> None:
        if isinstance(greeting, bytes):
            raise MalformedAnswerError("the stream began with a binary message")
        fields = Fields.parse(greeting, "stream message")
        if fields.values.get("type") == "error":
            self._state.on_message(greeting)
        self._state.on_opened(fields)

    async def _drop(self) -> None:
        socket, self._socket = self._socket, None
        if socket is not None:
            await socket.close()

    async def open(self) -> None:
        """Connect now, so that a missing map or a wrong key shows here."""
        await self._run_until(lambda: True)

    async def close(self) -> None:
        """Close without waiting for acknowledgements; unacknowledged scans may or may not have arrived."""
        await self._drop()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            if exc_type is None:
                await self.flush()
        finally:
            await self.close()

    async def __aiter__(self) -> AsyncIterator[MapChanges]:
        while (change := await self.next_change()) is not None:
            yield change

    @property
    def acks(self) -> Sequence[ScanAck]:
        """The most recent acknowledgements (up to 1,024), oldest first."""
        return tuple(self._state.acks)

    @property
    def acknowledged(self) -> int:
        """Scans acknowledged on this stream; `duplicates` of them the service had already."""
        return self._state.acknowledged

    @property
    def duplicates(self) -> int:
        """Acknowledged scans that the service had already."""
        return self._state.duplicates

    @property
    def unacknowledged(self) -> tuple[str, ...]:
        """scan_ids that are on their way, oldest first."""
        return self._state.unacknowledged

    @property
    def max_in_flight(self) -> int:
        """How many unacknowledged scans the service allows."""
        return self._state.max_in_flight

    @property
    def last_sequence(self) -> int | None:
        """Journal number of the last acknowledged scan; None before the first."""
        return self._state.last_sequence

    @property
    def has_refused(self) -> bool:
        """Whether scans were refused since the last `take_refused` or `flush`."""
        return bool(self._state.refused)

    def take_refused(self) -> list[RefusedScan]:
        """Scans refused since the last call or `flush`; a `flush` after this does not raise for them."""
        return self._state.take_refused()

    def __repr__(self) -> str:
        state = "open" if self._socket is not None else "closed"
        return (
            f"{type(self).__name__}({self._map_name!r} at {self._endpoint.url}, {state}, "
            f"{self.acknowledged} acknowledged, {self._state.in_flight} in flight)"
        )
