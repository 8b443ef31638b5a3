"""What reading a mesh or a robot may cost."""

from __future__ import annotations

import time
from dataclasses import dataclass

from rayvox.errors import LoadLimitError


@dataclass(frozen=True)
class LoadLimits:
    """Limits for everything that one mesh or robot brings, all its files together."""

    max_bytes: int = 256 << 20
    max_triangles: int = 4_000_000
    max_time_s: float = 60.0


class LoadBudget:
    """What is left of the limits; starts when it is made. Every method raises LoadLimitError naming the limit."""

    def __init__(self, limits: LoadLimits) -> None:
        self._limits = limits
        self._bytes = limits.max_bytes
        self._triangles = limits.max_triangles
        self._deadline = time.monotonic() + limits.max_time_s

    @property
    def bytes_left(self) -> int:
        return self._bytes

    def take_bytes(self, count: int, source: str) -> None:
        if count > self._bytes:
            raise LoadLimitError(f"{source}: {count} bytes; {self._bytes} are left of {self._limits.max_bytes}")
        self._bytes -= count
        self.check_time(source)

    def take_triangles(self, count: int, source: str) -> None:
        if count > self._triangles:
            raise LoadLimitError(
                f"{source}: {count} triangles; {self._triangles} are left of {self._limits.max_triangles}"
            )
        self._triangles -= count
        self.check_time(source)

    def check_time(self, source: str) -> None:
        """To be called every few thousand steps of any loop whose length the file decides."""
        if time.monotonic() > self._deadline:
            raise LoadLimitError(f"{source}: reading took longer than {self._limits.max_time_s:g} s")
