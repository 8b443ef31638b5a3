"""HTTP requests and responses as values, and the problem documents among the latter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rayvox_client.errors import MalformedAnswerError, ServiceError, service_error
from rayvox_client.fields import Fields
from rayvox_client.frame import Frame, OutgoingFrame, decode_frame
from rayvox_client.retry import parse_retry_after

PROBLEM_PREFIX = "urn:rayvox:problem:"


@dataclass(frozen=True)
class HttpRequest:
    """One request; `body` is sent as it is, a frame without being copied together."""

    method: str
    target: str
    body: bytes | OutgoingFrame = field(default=b"", repr=False)
    media_type: str | None = None


@dataclass(frozen=True)
class HttpResponse:
    """One response with its whole body; header names in lower case."""

    status: int
    headers: Mapping[str, str]
    body: bytes = field(repr=False)

    def raise_for_problem(self) -> HttpResponse:
        """This response if its status is 2xx, else the typed `ServiceError` of its problem document."""
        if 200 <= self.status < 300:
            return self
        raise problem_error(self.status, self.body, self.headers.get("retry-after"))

    def json(self) -> Fields:
        """The body as a JSON object."""
        return Fields.parse(self.body, "answer")

    def frame(self) -> Frame:
        """The body as a frame."""
        return decode_frame(self.body)


def problem_error(status: int, body: bytes, retry_after: str | None = None) -> ServiceError:
    """The typed error of an HTTP status with a body that should be a problem document."""
    retry_after_s = parse_retry_after(retry_after)
    try:
        problem = Fields.parse(body, "problem")
    except MalformedAnswerError:
        text = body[:200].decode(errors="replace").strip()
        return service_error(status, "", text or "the service gave no reason", retry_after_s)
    return problem_from_fields(problem, status, retry_after_s)


def problem_from_fields(problem: Fields, status: int | None = None, retry_after_s: float | None = None) -> ServiceError:
    """The typed error of a problem document (RFC 9457)."""
    if status is None:
        status = problem.integer("status")
    if retry_after_s is None and problem.has("retry_after_s"):
        retry_after_s = problem.number("retry_after_s")
    slug = str(problem.values.get("type", "")).removeprefix(PROBLEM_PREFIX)
    detail = problem.values.get("detail") or problem.values.get("title") or "the service gave no reason"
    return service_error(status, slug if slug != "about:blank" else "", str(detail), retry_after_s)
