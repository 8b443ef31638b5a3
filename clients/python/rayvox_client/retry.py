"""When to try again, and how long to wait before."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from email.utils import parsedate_to_datetime

from rayvox_client.errors import (
    ConnectionFailedError,
    InvalidInputError,
    OverloadedError,
    RayvoxClientError,
    ServiceError,
)


@dataclass(frozen=True)
class RetryPolicy:
    """Jittered exponential back-off.

    Only failed connections and answers 429 and 503 are tried again, always with the same request and scan_id.

    Attributes:
        retries: attempts after the first one; 0 for none.
        first_delay_s, factor, max_delay_s: the n-th wait lies in the upper half of
            min(max_delay_s, first_delay_s * factor**n), drawn at random so that robots do not come back in step.
        max_retry_after_s: a Retry-After up to this is waited for; a longer one raises at once.
    """

    retries: int = 5
    first_delay_s: float = 0.25
    factor: float = 2.0
    max_delay_s: float = 8.0
    max_retry_after_s: float = 60.0
    draw: Callable[[], float] = field(default=random.random, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.retries < 0 or self.first_delay_s < 0 or self.factor < 1 or self.max_delay_s < 0:
            raise InvalidInputError(f"{self!r}: retries and delays are at least 0, the factor at least 1")

    def start(self) -> Attempts:
        """The count of attempts of one request."""
        return Attempts(self)

    def delay_s(self, retry: int, retry_after_s: float | None = None) -> float:
        """Seconds to wait before retry number `retry` (0 for the first): never less than the service asked for."""
        step = min(self.max_delay_s, self.first_delay_s * self.factor ** min(retry, 64))
        jittered = step * (0.5 + 0.5 * self.draw())
        return jittered if retry_after_s is None else retry_after_s + 0.1 * jittered


class Attempts:
    """Counts the attempts of one request and says what to do after each failure."""

    def __init__(self, policy: RetryPolicy) -> None:
        self._policy = policy
        self._failures = 0
        self._answer_lost = False

    def delay_after(self, error: RayvoxClientError) -> float:
        """Seconds to wait before the next attempt; raises `error` itself when there is to be none."""
        if isinstance(error, ServiceError):
            error.after_lost_answer = self._answer_lost
        retry_after_s: float | None = None
        if isinstance(error, OverloadedError):
            retry_after_s = error.retry_after_s
        elif isinstance(error, ConnectionFailedError):
            self._answer_lost = True
        else:
            raise error
        if self._failures >= self._policy.retries or (retry_after_s or 0.0) > self._policy.max_retry_after_s:
            raise error
        self._failures += 1
        return self._policy.delay_s(self._failures - 1, retry_after_s)


def parse_retry_after(value: str | None, now_s: Callable[[], float] = time.time) -> float | None:
    """Seconds from a Retry-After header, which is either seconds or an HTTP date; None when absent or unreadable."""
    if value is None:
        return None
    try:
        seconds = float(value)
    except ValueError:
        try:
            seconds = parsedate_to_datetime(value).timestamp() - now_s()
        except ValueError:
            return None
    return max(0.0, seconds) if seconds < float("inf") else None
