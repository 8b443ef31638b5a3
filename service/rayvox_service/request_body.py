"""Reading request bodies: bounded before and while they arrive."""

from __future__ import annotations

import asyncio
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from starlette.requests import Request

from rayvox_service.frame import Bytes
from rayvox_service.problems import Problem
from rayvox_service.service import service_of
from rayvox_service.whole_body import whole_body

JSON = "application/json"
M = TypeVar("M", bound=BaseModel)


def media_type(request: Request, accepted: tuple[str, ...]) -> str:
    """The body's media type without parameters. Raises Problem unsupported-media-type."""
    given = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if given not in accepted:
        raise Problem("unsupported-media-type", f"Content-Type {given!r} is not one of {', '.join(accepted)}")
    if request.headers.get("content-encoding", "identity").lower() != "identity":
        raise Problem("unsupported-media-type", "bodies with a Content-Encoding are not taken; frames may hold zstd")
    return given


def announced_bytes(request: Request) -> int:
    """Content-Length, 0 where there is none."""
    try:
        return max(0, int(request.headers.get("content-length", "0")))
    except ValueError:
        raise Problem("invalid-input", "Content-Length is not a number") from None


async def read_body(request: Request, max_bytes: int) -> Bytes:
    """The whole body. Raises Problem too-large as soon as that is known, request-timeout when it takes too long."""
    if announced_bytes(request) > max_bytes:
        raise _too_large(announced_bytes(request), max_bytes)
    timeout_s = service_of(request).settings.body_timeout_s
    offered = whole_body(request.scope)
    try:
        async with asyncio.timeout(timeout_s):
            body = await _read_messages(request, max_bytes) if offered is None else await offered.read()
    except TimeoutError:
        raise Problem("request-timeout", f"the body did not arrive within {timeout_s:g} s") from None
    if body is None:
        raise Problem("request-timeout", "the connection ended within the body")
    return body


async def _read_messages(request: Request, max_bytes: int) -> bytes | None:
    chunks: list[bytes] = []
    received = 0
    while True:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            return None
        chunk = message.get("body", b"")
        received += len(chunk)
        if received > max_bytes:
            raise _too_large(received, max_bytes)
        chunks.append(chunk)
        if not message.get("more_body", False):
            return chunks[0] if len(chunks) == 1 else b"".join(chunks)


async def read_json(request: Request, model: type[M]) -> M:
    """A small JSON body as `model`. Raises Problem invalid-input and those of `read_body`."""
    media_type(request, (JSON,))
    return parse_json(await read_body(request, service_of(request).settings.max_json_bytes), model)


def parse_json(body: Bytes, model: type[M]) -> M:
    """Raises Problem invalid-input."""
    try:
        return model.model_validate_json(bytes(body))
    except ValidationError as error:
        raise _invalid(error) from None


def check_fields(fields: dict[str, Any], model: type[M]) -> M:
    """A frame's header fields as `model`. Raises Problem invalid-input."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        raise _invalid(error) from None


def _invalid(error: ValidationError) -> Problem:
    errors = [{"at": "/".join(map(str, e["loc"])), "message": e["msg"]} for e in error.errors()[:20]]
    detail = "; ".join(f"{e['at'] or 'body'}: {e['message']}" for e in errors[:5])
    return Problem("invalid-input", detail, errors=errors)


def _too_large(nbytes: int, max_bytes: int) -> Problem:
    return Problem("too-large", f"the body has {nbytes} bytes or more, the limit is {max_bytes}")
