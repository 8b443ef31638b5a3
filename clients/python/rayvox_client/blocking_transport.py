"""Sockets that block."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import ConnectionFailedError
from rayvox_client.transport import CLOSE_TIMEOUT_S, fragments, websocket_error

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

RECEIVE_BYTES = 1 << 18


class BlockingTransport:
    """Opens blocking connections. Its coroutines never suspend; drive them with `run_blocking`."""

    def __init__(self, endpoint: Endpoint, timeout_s: float, ssl_context: ssl.SSLContext | None) -> None:
        self._endpoint = endpoint
        self._timeout_s = timeout_s
        self._ssl = (ssl_context or ssl.create_default_context()) if endpoint.tls else None

    async def connect(self) -> BlockingByteStream:
        """A connected socket."""
        endpoint = self._endpoint
        try:
            connected = socket.create_connection((endpoint.host, endpoint.port), self._timeout_s)
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self._ssl is not None:
                connected = self._ssl.wrap_socket(connected, server_hostname=endpoint.host)
        except OSError as error:
            raise ConnectionFailedError(f"cannot connect to {endpoint.url}: {error}") from error
        return BlockingByteStream(connected, endpoint.url)

    async def open_messages(self, target: str) -> BlockingMessageStream:
        """An open WebSocket."""
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect

        try:
            # Entered, not only called: the library is about to do the handshake on entry.
            connection = connect(
                self._endpoint.websocket_url(target),
                ssl=self._ssl,
                additional_headers=self._endpoint.headers,
                user_agent_header=None,
                compression=None,
                open_timeout=self._timeout_s,
                close_timeout=CLOSE_TIMEOUT_S,
                max_size=None,
                proxy=None,
            ).__enter__()
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._endpoint.url) from error
        return BlockingMessageStream(connection, self._endpoint.url)

    async def sleep(self, seconds: float) -> None:
        """Block for so long."""
        time.sleep(seconds)


class BlockingByteStream:
    """A `ByteStream` on a blocking socket."""

    def __init__(self, connected: socket.socket, where: str) -> None:
        self._socket = connected
        self._where = where

    async def send(self, parts: Sequence[bytes | memoryview]) -> None:
        try:
            if isinstance(self._socket, ssl.SSLSocket):
                for part in parts:
                    self._socket.sendall(part)
            else:
                self._send_together([memoryview(part) for part in parts if len(part)])
        except OSError as error:
            raise ConnectionFailedError(f"sending to {self._where} failed: {error}") from error

    def _send_together(self, views: list[memoryview]) -> None:
        while views:
            sent = self._socket.sendmsg(views)
            while views and sent >= len(views[0]):
                sent -= len(views.pop(0))
            if sent:
                views[0] = views[0][sent:]

    async def receive(self) -> bytes:
        try:
            return self._socket.recv(RECEIVE_BYTES)
        except OSError as error:
            raise ConnectionFailedError(f"no answer from {self._where}: {error}") from error

    def is_stale(self) -> bool:
        # Nothing is due on an idle connection: a byte, the end of the stream or an error all mean that it is over.
        timeout_s = self._socket.gettimeout()
        try:
            self._socket.settimeout(0.0)
            self._socket.recv(1)
        except (BlockingIOError, ssl.SSLWantReadError):
            self._socket.settimeout(timeout_s)
            return False
        except OSError:
            return True
        return True

    def close(self) -> None:
        self._socket.close()


class BlockingMessageStream:
    """A `MessageStream` on the websockets library's threaded client."""

    def __init__(self, connection: ClientConnection, where: str) -> None:
        self._connection = connection
        self._where = where

    async def send(self, frame: bytes) -> None:
        from websockets.exceptions import WebSocketException

        try:
            self._connection.send(fragments(frame))
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._where) from error

    async def receive(self, timeout_s: float | None) -> str | bytes | None:
        from websockets.exceptions import WebSocketException

        try:
            return self._connection.recv(timeout_s)
        except TimeoutError:
            return None
        except (OSError, WebSocketException) as error:
            raise websocket_error(error, self._where) from error

    async def close(self) -> None:
        self._connection.close()
