"""Everything the client raises, one tree under `RayvoxClientError`.

`InvalidInputError` is raised locally, before anything is sent, and its subclass `RefusedInputError` when the service
found the fault; catching the first catches both. Every `ServiceError` carries the HTTP status and the slug of the
service's problem document.
"""

from __future__ import annotations


class RayvoxClientError(Exception):
    """Base of every error of this package."""


class ConnectionFailedError(RayvoxClientError, ConnectionError):
    """The service could not be reached, or the connection broke, and the retries are used up."""


class MalformedAnswerError(RayvoxClientError):
    """The service's answer is not what the API promises: bad JSON, a frame that fails its checks, a missing field."""


class WaitTimeoutError(RayvoxClientError, TimeoutError):
    """What was waited for did not happen within the time that the caller gave."""


class OutOfStepError(RayvoxClientError):
    """A map change starts from a revision that the local copy does not hold."""


class InvalidInputError(RayvoxClientError, ValueError):
    """An argument is wrong; the message names the index and the value. Nothing was changed."""


class ServiceError(RayvoxClientError):
    """The service answered with a problem document (RFC 9457).

    Attributes:
        status: HTTP status.
        slug: what kind of problem, e.g. `map-not-found`; empty when the answer was no problem document.
        detail: the service's sentence about it.
        retry_after_s: the service's Retry-After in seconds, None when it gave none.
        after_lost_answer: an earlier attempt of the same request lost its answer, so that the request may already
            have been carried out before this answer.
    """

    after_lost_answer = False

    def __init__(self, status: int, slug: str, detail: str, retry_after_s: float | None = None) -> None:
        super().__init__(status, slug, detail, retry_after_s)
        self.status = status
        self.slug = slug
        self.detail = detail
        self.retry_after_s = retry_after_s

    def __str__(self) -> str:
        return f"{self.detail} [{self.status}{' ' + self.slug if self.slug else ''}]"


class NotFoundError(ServiceError):
    """404: no such thing."""


class MapNotFoundError(NotFoundError):
    """The map does not exist."""


class RobotNotFoundError(NotFoundError):
    """The robot does not exist."""


class ConflictError(ServiceError):
    """409: it exists already, and differs."""


class MapExistsError(ConflictError):
    """A map of this name exists."""


class RobotExistsError(ConflictError):
    """A robot of this name exists, from another upload."""


class ScanConflictError(ConflictError):
    """The map holds another scan under this scan_id."""


class RefusedInputError(ServiceError, InvalidInputError):
    """400, 415, 422: the service found the input wrong."""


class OutOfRangeError(RefusedInputError):
    """Coordinates lie beyond the octree's range."""


class InvalidFrameError(RefusedInputError):
    """The service could not read the frame."""


class InvalidMapNameError(RefusedInputError):
    """The service does not allow this map name."""


class TooLargeError(ServiceError):
    """413: more bytes, points or triangles than the service takes."""


class UnauthorizedError(ServiceError):
    """401, 403: API key missing or wrong."""


class ServiceTimeoutError(ServiceError):
    """504: the service gave up waiting, e.g. for the revision that was asked for."""


class OverloadedError(ServiceError):
    """429: the map's queue is full; `retry_after_s` says when to come back. Raised once the retries are used up."""


class UnavailableError(OverloadedError):
    """503: the service is starting, stopping, or cannot write to its disk."""


_BY_SLUG: dict[str, type[ServiceError]] = {
    "map-not-found": MapNotFoundError,
    "map-exists": MapExistsError,
    "robot-not-found": RobotNotFoundError,
    "robot-exists": RobotExistsError,
    "invalid-robot-name": RefusedInputError,
    "scan-conflict": ScanConflictError,
    "invalid-input": RefusedInputError,
    "out-of-range": OutOfRangeError,
    "invalid-frame": InvalidFrameError,
    "invalid-map-name": InvalidMapNameError,
    "too-large": TooLargeError,
    "unauthorized": UnauthorizedError,
    "overloaded": OverloadedError,
    "unavailable": UnavailableError,
    "unsupported-media-type": RefusedInputError,
    "not-found": NotFoundError,
    "timeout": ServiceTimeoutError,
}
_BY_STATUS: dict[int, type[ServiceError]] = {
    400: RefusedInputError,
    401: UnauthorizedError,
    403: UnauthorizedError,
    404: NotFoundError,
    409: ConflictError,
    413: TooLargeError,
    415: RefusedInputError,
    422: RefusedInputError,
    429: OverloadedError,
    503: UnavailableError,
    504: ServiceTimeoutError,
}


def service_error(status: int, slug: str, detail: str, retry_after_s: float | None = None) -> ServiceError:
    """The typed error of a problem: by its slug, else by its status (a proxy's answer has no slug)."""
    error_type = _BY_SLUG.get(slug) or _BY_STATUS.get(status, ServiceError)
    return error_type(status, slug, detail, retry_after_s)
