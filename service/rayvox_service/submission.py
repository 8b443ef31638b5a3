"""One frame on its way into a map, and what its sender is told."""

from __future__ import annotations

import threading
import uuid
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Literal

from rayvox_service.frame import Bytes
from rayvox_service.map_operation import Operation
from rayvox_service.self_filter import RobotLookup, no_robots

Wait = Literal["journaled", "applied"]


@dataclass(frozen=True, slots=True)
class Receipt:
    """What became of one submitted frame. `revision` is one that contains it, None while only journaled."""

    scan_id: uuid.UUID | None
    sequence: int
    status: Wait
    revision: int | None
    duplicate: bool
    statistics: dict[str, Any] | None = None

    def document(self) -> dict[str, Any]:
        return {
            "scan_id": None if self.scan_id is None else str(self.scan_id),
            "sequence": self.sequence,
            "status": self.status,
            "revision": self.revision,
            "duplicate": self.duplicate,
            "statistics": self.statistics,
        }


@dataclass(slots=True)
class Submission:
    """A frame that has to be of kind `kind`. `scan_id` is what the sender promised, or what was found in the frame.

    Both futures come to a receipt or a Problem; `wait` says which one the sender waits for. `reserved` are the bytes
    that it holds of the map's queue. `find_robot` knows the robots that a scan may name.
    """

    kind: str
    data: Bytes
    scan_id: uuid.UUID | None
    wait: Wait = "journaled"
    find_robot: RobotLookup = no_robots
    reserved: int = 0
    journaled: Future[Receipt] = field(default_factory=Future)
    applied: Future[Receipt] = field(default_factory=Future)


class CommitGroup:
    """Records that go to disk under one fdatasync, and share its fate."""

    __slots__ = ("failed", "settled")

    def __init__(self) -> None:
        self.settled = threading.Event()
        self.failed = False


@dataclass(slots=True)
class Entry:
    """A submission that was checked and may be journaled; `retries` are the same scan sent again meanwhile."""

    submission: Submission
    operation: Operation
    group: CommitGroup
    crc32c: int
    nbytes: int
    sequence: int = 0
    retries: list[Submission] = field(default_factory=list)
