"""A bound on bytes that wait, shared by the threads that add and remove them."""

from __future__ import annotations

import threading

from rayvox_service.problems import Problem
from rayvox_service.submission import Submission


class ByteBudget:
    """Counts what submissions hold of a map's queue."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._lock = threading.Lock()
        self.used = 0

    def check_room(self, nbytes: int) -> None:
        """Raises Problem overloaded when so many bytes would not be taken now."""
        # What is larger than the whole queue is still taken when nothing else waits: it could never go otherwise.
        if self.used and self.used + nbytes > self._limit:
            raise Problem("overloaded", f"{self.used} bytes wait to be applied, the limit is {self._limit}")

    def take(self, submission: Submission) -> None:
        """Raises Problem overloaded with nothing taken."""
        with self._lock:
            self.check_room(len(submission.data))
            submission.reserved = len(submission.data)
            self.used += submission.reserved

    def change(self, submission: Submission, by: int) -> None:
        """What was taken may grow past the limit: it is on its way already."""
        with self._lock:
            self.used += by
            submission.reserved += by

    def release(self, submission: Submission) -> None:
        self.change(submission, -submission.reserved)
