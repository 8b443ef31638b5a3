"""Reading request bodies: bounded before and while they arrive."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TypeVar

from pydantic import BaseModel
from starlette.requests import Request
from starlette.types import Receive, Scope

from rayvox_service.checked_fields import parse_json
from rayvox_service.frame import Bytes
from rayvox_service.problems import Problem
from rayvox_service.service import service_of
from rayvox_service.whole_body import whole_body

JSON = "application/json"
M = TypeVar("M", bound=BaseModel)


class RequestBody:
    """The body of one ASGI request, and what its headers say of it."""

    def __init__(self, scope: Scope, receive: Receive) -> None:
        self._scope = scope
        self._receive = receive
        # ASGI gives names in lower case.
        self._headers: dict[bytes, bytes] = dict(scope["headers"])

    def media_type(self, accepted: Sequence[str]) -> str:
        """Without parameters. Raises Problem unsupported-media-type."""
        given = self._header(b"content-type", "").partition(";")[0].strip().lower()
        if given not in accepted:
            raise Problem("unsupported-media-type", f"Content-Type {given!r} is not one of {', '.join(accepted)}")
        if self._header(b"content-encoding", "identity").lower() != "identity":
            raise Problem("unsupported-media-type", "no body with a Content-Encoding is taken; frames may hold zstd")
        return given

    def announced_bytes(self) -> int:
        """Content-Length, 0 where there is none. Raises Problem invalid-input."""
        try:
            return max(0, int(self._header(b"content-length", "0")))
        except ValueError:
            raise Problem("invalid-input", "Content-Length is not a number") from None

    async def read(self, max_bytes: int, timeout_s: float) -> Bytes:
        """The whole body. Raises Problem too-large as soon as that is known, request-timeout when it takes too long."""
        if self.announced_bytes() > max_bytes:
            raise _too_large(self.announced_bytes(), max_bytes)
        offered = whole_body(self._scope)
        try:
            async with asyncio.timeout(timeout_s):
                body = await self._read_messages(max_bytes) if offered is None else await offered.read()
        except TimeoutError:
            raise Problem("request-timeout", f"the body did not arrive within {timeout_s:g} s") from None
        if body is None:
            raise Problem("request-timeout", "the connection ended within the body")
        return body

    async def _read_messages(self, max_bytes: int) -> bytes | None:
        chunks: list[bytes] = []
        received = 0
        while True:
            message = await self._receive()
            if message["type"] == "http.disconnect":
                return None
            chunk = message.get("body", b"")
            received += len(chunk)
            if received > max_bytes:
                raise _too_large(received, max_bytes)
            chunks.append(chunk)
            if not message.get("more_body", False):
                return chunks[0] if len(chunks) == 1 else b"".join(chunks)

    def _header(self, name: bytes, default: str) -> str:
        value = self._headers.get(name)
        return default if value is None else value.decode("latin-1")


async def read_json(request: Request, model: type[M]) -> M:
    """A small JSON body as `model`. Raises Problem invalid-input and those of `RequestBody`."""
    body, settings = RequestBody(request.scope, request.receive), service_of(request).settings
    body.media_type((JSON,))
    return parse_json(await body.read(settings.max_json_bytes, settings.body_timeout_s), model)


def _too_large(nbytes: int, max_bytes: int) -> Problem:
    return Problem("too-large", f"the body has {nbytes} bytes or more, the limit is {max_bytes}")
