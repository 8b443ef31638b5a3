"""HTTP/1.1 over a byte stream, and a pool of such connections."""

from __future__ import annotations

import h11

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
        self._protocol = h11.Connection(h11.CLIENT)

    async def exchange(self, request: HttpRequest) -> HttpResponse:
        """Send a request and read its answer whole; ConnectionFailedError when the connection breaks."""
        try:
            try:
                await self._stream.send(self._serialise(request))
            except ConnectionFailedError:
                # A service that refuses early answers and closes while the body is still going out.
                return await self._read_response()
            return await self._read_response()
        except h11.RemoteProtocolError as error:
            raise ConnectionFailedError(f"{self._endpoint.url} broke off its answer: {error}") from error

    def _serialise(self, request: HttpRequest) -> list[bytes]:
        headers = [("Host", self._endpoint.authority), *self._endpoint.headers, ("Accept", "*/*")]
        if request.media_type is not None:
            headers.append(("Content-Type", request.media_type))
        if request.body or request.method in ("PUT", "POST"):
            headers.append(("Content-Length", str(len(request.body))))
        head = self._protocol.send(h11.Request(method=request.method, target=request.target, headers=headers))
        parts = [head] if head else []
        if request.body:
            # The passthrough hands back the very same bytes, uncopied.
            parts += self._protocol.send_with_data_passthrough(h11.Data(data=request.body)) or []
        self._protocol.send(h11.EndOfMessage())
        return parts

    async def _read_response(self) -> HttpResponse:
        status, headers, chunks = 0, {}, list[bytes]()
        while True:
            event = self._protocol.next_event()
            if event is h11.NEED_DATA:
                self._protocol.receive_data(await self._stream.receive())
            elif isinstance(event, h11.Response):
                status = event.status_code
                headers = {name.decode("ascii"): value.decode("latin-1") for name, value in event.headers}
            elif isinstance(event, h11.Data):
                chunks.append(bytes(event.data))
            elif isinstance(event, h11.EndOfMessage):
                return HttpResponse(status, headers, chunks[0] if len(chunks) == 1 else b"".join(chunks))
            elif not isinstance(event, h11.InformationalResponse):
                raise ConnectionFailedError(f"{self._endpoint.url} closed the connection without an answer")

    def recycle(self) -> bool:
        """Make ready for the next request; False when the connection cannot serve one."""
        if self._protocol.our_state is not h11.DONE or self._protocol.their_state is not h11.DONE:
            return False
        self._protocol.start_next_cycle()
        return True

    def is_stale(self) -> bool:
        """Whether the service closed this idle connection."""
        return self._stream.is_stale()

    def close(self) -> None:
        """Close the socket."""
        self._stream.close()


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
        if connection.recycle() and len(self._idle) < MAX_IDLE and not self._closed:
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
