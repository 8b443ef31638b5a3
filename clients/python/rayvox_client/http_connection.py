"""HTTP/1.1 over a byte stream, and a pool of such connections."""

from __future__ import annotations

from contextlib import suppress

import httptools

from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import ConnectionFailedError, RayvoxClientError
from rayvox_client.http_message import HttpRequest, HttpResponse
from rayvox_client.transport import ByteStream, Transport

MAX_IDLE = 16


class HttpConnection:
    """One keep-alive connection; one request at a time."""

    def __init__(self, stream: ByteStream, endpoint: Endpoint) -> None:
        self._stream = stream
        self._endpoint = endpoint
        self.is_reusable = True

    async def exchange(self, request: HttpRequest) -> HttpResponse:
        """Send a request and read its answer whole; ConnectionFailedError when the connection breaks."""
        self.is_reusable = False
        # A service that refuses early answers and closes while the body is still going out.
        with suppress(ConnectionFailedError):
            await self._send(request)
        answer = IncomingAnswer()
        while answer.response is None:
            try:
                answer.feed(await self._stream.receive())
            except (httptools.HttpParserError, EOFError) as error:
                raise ConnectionFailedError(f"{self._endpoint.url} broke off its answer: {error}") from error
        self.is_reusable = answer.keeps_alive
        return answer.response

    async def _send(self, request: HttpRequest) -> None:
        head = self._head(request)
        if isinstance(request.body, bytes):
            await self._stream.send([head, request.body])
        else:
            # The head goes ahead: the service looks up where the frame belongs while its checksum is made.
            await self._stream.send([head])
            await self._stream.send(request.body.parts())

    def _head(self, request: HttpRequest) -> bytes:
        headers = [("Host", self._endpoint.authority), *self._endpoint.headers, ("Accept", "*/*")]
        if request.media_type is not None:
            headers.append(("Content-Type", request.media_type))
        if len(request.body) or request.method in ("PUT", "POST"):
            headers.append(("Content-Length", str(len(request.body))))
        lines = [f"{request.method} {request.target} HTTP/1.1", *(f"{name}: {value}" for name, value in headers)]
        return "\r\n".join([*lines, "", ""]).encode("ascii")

    def is_stale(self) -> bool:
        """Whether the service closed this idle connection."""
        return self._stream.is_stale()

    def close(self) -> None:
        """Close the socket."""
        self._stream.close()


class IncomingAnswer:
    """One HTTP/1.1 answer as it arrives.

    Attributes:
        response: the answer once its last byte has arrived, None before.
        keeps_alive: whether the connection then takes another request.
    """

    def __init__(self) -> None:
        self.response: HttpResponse | None = None
        self.keeps_alive = False
        self._headers: dict[str, str] = {}
        self._chunks: list[bytes] = []
        self._ends_with_connection = False
        self._parser = httptools.HttpResponseParser(self)

    def feed(self, data: bytes) -> None:
        """The next bytes, none at the end of the connection. Raises EOFError, httptools.HttpParserError."""
        if data:
            self._parser.feed_data(data)
        elif self._ends_with_connection:
            self.on_message_complete()
        else:
            raise EOFError("the connection was closed")

    # Called by the parser

    def on_message_begin(self) -> None:
        # After the answer: one that nobody asked for.
        self.keeps_alive = False
        self._headers, self._chunks = {}, []

    def on_header(self, name: bytes, value: bytes) -> None:
        self._headers[name.decode("ascii").lower()] = value.decode("latin-1")

    def on_headers_complete(self) -> None:
        self._ends_with_connection = self._headers.keys().isdisjoint({"content-length", "transfer-encoding"})

    def on_body(self, body: bytes) -> None:
        self._chunks.append(body)

    def on_message_complete(self) -> None:
        status = self._parser.get_status_code()
        # What is below 200 only informs, before the answer.
        if status >= 200 and self.response is None:
            body = self._chunks[0] if len(self._chunks) == 1 else b"".join(self._chunks)
            self.response = HttpResponse(status, self._headers, body)
            self.keeps_alive = self._parser.should_keep_alive()
        self._ends_with_connection = False


class HttpPool:
    """Idle connections to one service, used last in first out. Threads may share it."""

    def __init__(self, transport: Transport, endpoint: Endpoint) -> None:
        self._transport = transport
        self._endpoint = endpoint
        self._idle: list[HttpConnection] = []
        self._closed = False

    async def exchange(self, request: HttpRequest) -> HttpResponse:
        """One request on an idle or a new connection; ConnectionFailedError when it breaks."""
        connection = await self._take()
        try:
            response = await connection.exchange(request)
        except BaseException:
            connection.close()
            raise
        if connection.is_reusable and len(self._idle) < MAX_IDLE and not self._closed:
            self._idle.append(connection)
        else:
            connection.close()
        return response

    async def _take(self) -> HttpConnection:
        if self._closed:
            raise RayvoxClientError("the client is closed")
        while self._idle:
            try:
                connection = self._idle.pop()
            except IndexError:  # another thread took it
                break
            if not connection.is_stale():
                return connection
            connection.close()
        return HttpConnection(await self._transport.connect(), self._endpoint)

    def close(self) -> None:
        """Close the idle connections; further requests raise RayvoxClientError."""
        self._closed = True
        while self._idle:
            self._idle.pop().close()
