"""What a journal record does to the map. The same code checks a new record and replays an old one."""

from __future__ import annotations

import math
import uuid
from dataclasses import dataclass
from typing import Any

from rayvox import Engine, InvalidInputError, OccupancyMap, PreparedScan

from rayvox_service import scan
from rayvox_service.frame import Frame, encode_frame
from rayvox_service.map_config import InsertionConfig

CLEAR_BOX = "clear_box"
Corner = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Outcome:
    revision: int
    statistics: dict[str, Any] | None


@dataclass(frozen=True, slots=True)
class ScanIdentity:
    """CRC-32C and length of a frame as it was received."""

    crc32c: int
    nbytes: int


@dataclass(frozen=True, slots=True)
class ScanOperation:
    """A validated and transformed scan: inserting it cannot fail on its values.

    `dropped` counts what was taken out of the scan as it was `received`.
    """

    scan_id: uuid.UUID
    prepared: PreparedScan
    received: ScanIdentity
    dropped: dict[str, int]

    @property
    def nbytes(self) -> int:
        return self.prepared.nbytes

    def apply(self, occupancy_map: OccupancyMap, engine: Engine) -> Outcome:
        result = occupancy_map.insert_prepared(self.prepared, engine)
        return Outcome(result.revision, vars(result.statistics) | self.dropped)


@dataclass(frozen=True, slots=True)
class ClearOperation:
    """Everything known inside the box becomes unknown; corners in metres, map frame."""

    lo: Corner
    hi: Corner
    nbytes: int = 0

    def apply(self, occupancy_map: OccupancyMap, engine: Engine) -> Outcome:
        return Outcome(occupancy_map.clear_box(self.lo, self.hi), None)


Operation = ScanOperation | ClearOperation


def parse_operation(
    frame: Frame, occupancy_map: OccupancyMap, insertion: InsertionConfig, max_points: int | None = None
) -> Operation:
    """Check a record against the map it is for, without touching the map.

    Raises FrameError, Problem or rayvox.InvalidInputError.
    """
    if frame.kind == CLEAR_BOX:
        lo, hi = _corner(frame, "lo"), _corner(frame, "hi")
        check_box(lo, hi)
        return ClearOperation(lo, hi)
    scan_id = scan.parse_scan_id(frame.fields.get("scan_id"))
    received, dropped = ScanIdentity(frame.crc32c, frame.nbytes), {}
    if frame.kind == scan.FILTERED_KIND:
        received, dropped = ScanIdentity(**frame.fields["received"]), frame.fields["dropped"]
    arguments = scan.scan_arguments(frame, max_points).reduced(insertion)
    return ScanOperation(scan_id, arguments.prepare(occupancy_map), received, dropped)


def clear_frame(lo: Corner, hi: Corner) -> bytes:
    return encode_frame(CLEAR_BOX, {"lo": lo, "hi": hi}, {})


def check_box(lo: Corner, hi: Corner) -> None:
    """What the kernel asks of a box, before the journal has it; parts beyond the map's range are fine."""
    for axis, low, high in zip("xyz", lo, hi, strict=True):
        if not -math.inf < low <= high < math.inf:
            raise InvalidInputError(f"box: {axis} from {low} to {high} is not a finite range in order")


def _corner(frame: Frame, name: str) -> Corner:
    values = scan.numbers(frame, name, 3, None)
    if values is None:
        raise InvalidInputError(f"{name} is missing")
    return values[0], values[1], values[2]
