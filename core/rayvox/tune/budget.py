"""Time that may be spent, and what is told about it while it is."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_WIDTH = 30


class Budget:
    """Counts from its making."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._started = time.monotonic()

    @property
    def spent_s(self) -> float:
        return time.monotonic() - self._started

    @property
    def left_s(self) -> float:
        return self.limit_s - self.spent_s

    def affords(self, cost_s: float) -> bool:
        """Whether something that takes so long would still end in time."""
        return cost_s <= self.left_s


class Progress:
    """A bar of the time spent on a terminal, a line now and then elsewhere; says nothing without a stream."""

    def __init__(self, budget: Budget, stream: TextIO | None = None, every_s: float = 10.0) -> None:
        self._budget, self._stream, self._every_s = budget, stream, every_s
        self._measured, self._last_s = 0, 0.0
        self._terminal = stream is not None and stream.isatty()

    def measured(self, what: str) -> None:
        """One more measurement is done."""
        self._measured += 1
        spent_s = self._budget.spent_s
        if self._stream is None or not (self._terminal or spent_s - self._last_s >= self._every_s):
            return
        self._last_s = spent_s
        share = min(1.0, spent_s / self._budget.limit_s)
        bar = "#" * round(_WIDTH * share)
        line = f"[{bar:<{_WIDTH}}] {spent_s:4.0f} of {self._budget.limit_s:.0f} s  {self._measured} measured  {what}"
        self._stream.write(f"\r{line[:118]:<118}" if self._terminal else f"{line}\n")
        self._stream.flush()

    def end(self) -> None:
        if self._terminal and self._stream is not None:
            self._stream.write("\n")


def standard_progress(budget: Budget) -> Progress:
    """On standard error."""
    return Progress(budget, sys.stderr)
