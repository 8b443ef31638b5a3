"""Large request bodies without copies: uvicorn's protocol, and an ASGI extension by which a route takes the whole body.

As ASGI hands it over, a body is copied five times and the socket stops being read every 64 KiB. Here the route, once it
has decided to take the body, has the socket read straight into one buffer of the announced size. A server without the
extension, and a body that it is not made for, go ASGI's usual way.
"""

from __future__ import annotations

import asyncio
from typing import Any

import httptools
import numpy as np
from starlette.types import Scope
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

EXTENSION = "rayvox.whole_body"
# Smaller bodies mostly arrive in one piece, with their headers.
MIN_BYTES = 1 << 16


class WholeBodyProtocol(HttpToolsProtocol):
    """Adds the extension to the scope of each request with a large body of announced size."""

    def on_headers_complete(self) -> None:
        # The scope is a dictionary that the application sees only later: its task has been made, but has not run.
        super().on_headers_complete()
        if self.cycle is None or self.cycle.scope is not self.scope:
            return  # an upgrade
        headers = dict(self.headers)
        announced = headers.get(b"content-length", b"")
        if announced.isdigit() and int(announced) >= MIN_BYTES and not self.expect_100_continue:
            extensions: dict[str, Any] = {EXTENSION: WholeBody(self, self.cycle, int(announced))}
            self.scope["extensions"] = extensions

    def end_body(self) -> None:
        """The body was read past the parser, to its last byte: the next request meets a new one."""
        self.parser = httptools.HttpRequestParser(self)
        self.cycle.more_body = False


class WholeBody:
    """The body of one request, not yet taken."""

    def __init__(self, protocol: WholeBodyProtocol, cycle: RequestResponseCycle, nbytes: int) -> None:
        self._protocol = protocol
        self._cycle = cycle
        self._nbytes = nbytes

    @property
    def is_under_way(self) -> bool:
        """Whether bytes are still to come; if not, ASGI's way is the shortest."""
        return self._cycle.more_body and not self._cycle.disconnected

    async def read(self) -> memoryview | None:
        """The body, read-only; None when the connection ended before it did."""
        receiver = _Receiver(self._protocol, self._cycle.body, self._nbytes)
        self._cycle.body = bytearray()
        return await receiver.receive()


class _Receiver(asyncio.BufferedProtocol):
    """Stands in for the HTTP protocol while the rest of a body arrives."""

    def __init__(self, http: WholeBodyProtocol, begun: bytearray, nbytes: int) -> None:
        self._http = http
        self._octets = np.empty(nbytes, np.uint8)
        self._octets[: len(begun)] = begun
        self._view = self._octets.data
        self._parsed = self._filled = len(begun)
        self._done: asyncio.Future[bool] = http.loop.create_future()

    async def receive(self) -> memoryview | None:
        transport = self._http.transport
        transport.set_protocol(self)
        self._http.flow.resume_reading()
        try:
            complete = await self._done
        except asyncio.CancelledError:
            # Whoever gave up still answers: the parser learns what was read past it, and skips the rest as it comes.
            transport.set_protocol(self._http)
            self._http.data_received(bytes(self._view[self._parsed : self._filled]))
            raise
        if not complete:
            return None
        self._octets.flags.writeable = False
        return self._octets.data

    def get_buffer(self, sizehint: int) -> memoryview:
        return self._view[self._filled :]

    def buffer_updated(self, nbytes: int) -> None:
        self._filled += nbytes
        if self._filled == len(self._view):
            self._http.transport.set_protocol(self._http)
            self._http.end_body()
            self._settle(True)

    def _settle(self, complete: bool) -> None:
        if not self._done.done():
            self._done.set_result(complete)

    def eof_received(self) -> None:
        self._http.eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        self._http.connection_lost(exc)
        self._settle(False)

    def pause_writing(self) -> None:
        self._http.pause_writing()

    def resume_writing(self) -> None:
        self._http.resume_writing()


def whole_body(scope: Scope) -> WholeBody | None:
    """The body that the server offers to hand over as a whole, if it does."""
    offered = scope.get("extensions", {}).get(EXTENSION)
    return offered if isinstance(offered, WholeBody) and offered.is_under_way else None
