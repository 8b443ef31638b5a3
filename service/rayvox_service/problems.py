"""Every error answer is an RFC 9457 problem: one type per slug, one place that turns it into a response."""

from __future__ import annotations

import logging
from typing import Any

from fastapi.exceptions import ValidationException
from rayvox.errors import (
    InvalidInputError,
    LoadLimitError,
    MeshFormatError,
    MissingDependencyError,
    OutOfRangeError,
    RobotFormatError,
    ScanFormatError,
)
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse

from rayvox_service.frame import FrameError, FrameTooLargeError

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 1

KINDS: dict[str, tuple[int, str]] = {
    "invalid-frame": (400, "The body is not a valid frame"),
    "unauthorized": (401, "A valid API key is needed"),
    "not-found": (404, "There is nothing at this address"),
    "map-not-found": (404, "There is no map of this name"),
    "robot-not-found": (404, "There is no robot of this name"),
    "method-not-allowed": (405, "This address does not take this method"),
    "request-timeout": (408, "The request's body took too long"),
    "map-exists": (409, "A map of this name exists already"),
    "robot-exists": (409, "A robot of this name exists already"),
    "scan-conflict": (409, "This scan id was used for other bytes"),
    "too-large": (413, "The request is over a size limit"),
    "unsupported-media-type": (415, "The body's media type is not taken here"),
    "invalid-input": (422, "The request's values cannot be used"),
    "invalid-map-name": (422, "This is no possible map name"),
    "invalid-robot-name": (422, "This is no possible robot name"),
    "out-of-range": (422, "Coordinates lie beyond the map's range"),
    "overloaded": (429, "The map's queue is full"),
    "cancelled": (499, "The client went away before the answer"),
    "internal": (500, "The service failed"),
    "unavailable": (503, "The map cannot be used at the moment"),
    "timeout": (504, "What was waited for did not happen in time"),
}
_SLUG_OF_STATUS = {404: "not-found", 405: "method-not-allowed", 413: "too-large", 415: "unsupported-media-type"}

log = logging.getLogger(__name__)


class Problem(Exception):
    """An error that is answered to the client under its slug (a key of KINDS)."""

    def __init__(self, slug: str, detail: str, **extra: Any) -> None:
        super().__init__(detail)
        self.slug = slug
        self.detail = detail
        self.extra = extra
        self.status, self.title = KINDS[slug]

    @property
    def headers(self) -> dict[str, str]:
        if self.slug in ("overloaded", "unavailable"):
            return {"Retry-After": str(RETRY_AFTER_S)}
        return {"WWW-Authenticate": "Bearer"} if self.slug == "unauthorized" else {}

    def document(self, instance: str) -> dict[str, Any]:
        """The RFC 9457 object, with the request's path as the instance."""
        return {
            "type": f"urn:rayvox:problem:{self.slug}",
            "title": self.title,
            "status": self.status,
            "detail": self.detail,
            "instance": instance,
            **self.extra,
        }

    def response(self, instance: str) -> JSONResponse:
        return JSONResponse(self.document(instance), self.status, self.headers, MEDIA_TYPE)


async def answer_validation_error(request: Request, error: Exception) -> JSONResponse:
    """FastAPI's own checks of path and query, of requests and of handshakes."""
    assert isinstance(error, ValidationException)
    errors = [{"at": "/".join(map(str, e["loc"])), "message": e["msg"]} for e in error.errors()]
    detail = "; ".join(f"{e['at']}: {e['message']}" for e in errors[:5])
    return Problem("invalid-input", detail, errors=errors[:20]).response(request.url.path)


async def answer_http_exception(request: Request, error: Exception) -> JSONResponse:
    """Errors raised by the framework: no such route, wrong method, body that is no JSON."""
    assert isinstance(error, HTTPException)
    slug = _SLUG_OF_STATUS.get(error.status_code, "invalid-input" if error.status_code < 500 else "internal")
    problem = Problem(slug, f"{request.method} {request.url.path}: {error.detail}")
    response = problem.response(request.url.path)
    for name, value in (error.headers or {}).items():
        response.headers[name] = value
    return response


def as_problem(error: Exception) -> Problem:
    """The problem that an error of the frame codec or of the kernel is for a client; `internal` for all others."""
    match error:
        case Problem():
            return error
        case FrameTooLargeError() | LoadLimitError():
            return Problem("too-large", str(error))
        case FrameError():
            return Problem("invalid-frame", str(error))
        case OutOfRangeError():
            return Problem("out-of-range", str(error))
        case InvalidInputError() | ScanFormatError() | MeshFormatError() | RobotFormatError():
            return Problem("invalid-input", str(error))
        case MissingDependencyError():
            return Problem("unsupported-media-type", str(error))
        case OSError():
            log.error("disk: %s", error)
            return Problem("unavailable", f"the disk refused: {error.strerror or error}")
    log.error("unforeseen error", exc_info=error)
    return Problem("internal", "the service failed; its log says why")


async def answer_error(request: Request, error: Exception) -> JSONResponse:
    return as_problem(error).response(request.url.path)
