"""Sockets on asyncio."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import ConnectionFailedError
from rayvox_client.transport import CLOSE_TIMEOUT_S, fragments, websocket_error

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

RECEIVE_BYTES = 1 << 18


class AsyncTransport:
    """Opens connections on the running event loop."""

    def __init__(self, endpoint: Endpoint, timeout_s: float, ssl_context: ssl.SSLContext | None) -> None:
        self._endpoint = endpoint
        self._timeout_s = timeout_s
        self._ssl = (ssl_context or ssl.create_default_context()) if endpoint.tls else None

    async def connect(self) -> AsyncByteStream:
        """A connected socket."""
        endpoint = self._endpoint
        try:
            async with asyncio.timeout(self._timeout_s):
                reader, writer = await asyncio.open_connection(
                    endpoint.host, endpoint.port, ssl=self._ssl, limit=RECEIVE_BYTES
                )
        except OSError as error:
            raise ConnectionFailedError(f"cannot connect to {endpoint.url}: {error or 'timed out'}") from error
        return AsyncByteStream(reader, writer, endpoint.url, self._timeout_s)

    async def open_messages(self, target: str) -> AsyncMessageStream:
        """An open WebSocket."""
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        try:
            connection = await connect(
                self._endpoint.websocket_url(target),
                ssl=self._ssl,
                additional_headers=self._endpoint.headers,
                user_agent_header=None,
                compression=None,
                open_timeout=self._timeout_s,
                close_timeout=CLOSE_TIMEOUT_S,
                max_size=None,
                proxy=None,
            )
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._endpoint.url) from error
        return AsyncMessageStream(connection, self._endpoint.url)

    async def sleep(self, seconds: float) -> None:
        """Suspend for so long."""
        await asyncio.sleep(seconds)


class AsyncByteStream:
    """A `ByteStream` on asyncio's streams."""

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, where: str, timeout_s: float
    ) -> None:
        self._reader = reader
        self._writer = writer
        self._where = where
        self._timeout_s = timeout_s

    async def send(self, parts: Sequence[bytes | memoryview]) -> None:
        try:
            # Not writelines(): it joins its parts, another copy of the scan.
            for part in parts:
                self._writer.write(part)
            async with asyncio.timeout(self._timeout_s):
                await self._writer.drain()
        except OSError as error:
            raise ConnectionFailedError(f"sending to {self._where} failed: {error or 'timed out'}") from error

    async def receive(self) -> bytes:
        try:
            async with asyncio.timeout(self._timeout_s):
                return await self._reader.read(RECEIVE_BYTES)
        except OSError as error:
            raise ConnectionFailedError(f"no answer from {self._where}: {error or 'timed out'}") from error

    def is_stale(self) -> bool:
        return self._reader.at_eof() or self._writer.is_closing() or self._reader.exception() is not None

    def close(self) -> None:
        self._writer.close()


class AsyncMessageStream:
    """A `MessageStream` on the websockets library's asyncio client."""

    def __init__(self, connection: ClientConnection, where: str) -> None:
        self._connection = connection
        self._where = where

    async def send(self, frame: bytes) -> None:
        from websockets.exceptions import WebSocketException

        try:
            await self._connection.send(fragments(frame))
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._where) from error

    async def receive(self, timeout_s: float | None) -> str | bytes | None:
        from websockets.exceptions import WebSocketException

        try:
            async with asyncio.timeout(timeout_s):
                return await self._connection.recv()
        except TimeoutError:
            return None
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._where) from error

    async def close(self) -> None:
        await self._connection.close()
