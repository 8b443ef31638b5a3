"""Answers to queries."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rayvox_client.errors import MalformedAnswerError
from rayvox_client.frame import Frame

UNKNOWN = 0
FREE = 1
OCCUPIED = 2


@dataclass(frozen=True, eq=False, repr=False)
class Occupancy:
    """States of points or boxes, all on one revision of the map.

    Attributes:
        states: (n,) uint8: 0 unknown, 1 free, 2 occupied.
        log_odds: (n,) float32, NaN where unknown; None for boxes.
        revision: the map's revision that was asked.
    """

    states: NDArray[np.uint8]
    log_odds: NDArray[np.float32] | None
    revision: int

    @property
    def free(self) -> NDArray[np.bool_]:
        """(n,) bool."""
        return np.equal(self.states, FREE)

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """(n,) bool."""
        return np.equal(self.states, OCCUPIED)

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """(n,) bool."""
        return np.equal(self.states, UNKNOWN)

    @classmethod
    def from_frame(cls, frame: Frame, count: int) -> Occupancy:
        """Read an `occupancy` frame that answers `count` points or boxes."""
        frame.expect("occupancy")
        states = frame.array("states", "|u1")
        log_odds = frame.array("log_odds", "<f4") if "log_odds" in frame.payloads else None
        if len(states) != count or (log_odds is not None and len(log_odds) != count):
            raise MalformedAnswerError(f"occupancy frame: {len(states)} states answer {count} questions")
        return cls(states, log_odds, frame.fields.integer("revision"))

    def __repr__(self) -> str:
        counts = np.bincount(self.states, minlength=3)
        return (
            f"Occupancy({counts[OCCUPIED]} occupied, {counts[FREE]} free, {counts[UNKNOWN]} unknown "
            f"at revision {self.revision})"
        )


@dataclass(frozen=True, eq=False, repr=False)
class RayHits:
    """What rays met, all on one revision of the map.

    Attributes:
        hit: (n,) uint8: 0 nothing within range, 1 an occupied voxel, 2 unknown space (with unknown="occupied").
        t_m: (n,) float64, metres along each ray.
        voxel: (n,3) int64 finest-level key of the voxel that was met.
        revision: the map's revision that was asked.
    """

    hit: NDArray[np.uint8]
    t_m: NDArray[np.float64]
    voxel: NDArray[np.int64] = field(repr=False)
    revision: int

    @classmethod
    def from_frame(cls, frame: Frame, count: int) -> RayHits:
        """Read a `hits` frame that answers `count` rays."""
        frame.expect("hits")
        hit, t_m, voxel = frame.array("hit", "|u1"), frame.array("t_m", "<f8"), frame.array("voxel", "<i8", columns=3)
        if not len(hit) == len(t_m) == len(voxel) == count:
            raise MalformedAnswerError(f"hits frame: {len(hit)} hits answer {count} rays")
        return cls(hit, t_m, voxel, frame.fields.integer("revision"))

    def __repr__(self) -> str:
        counts = np.bincount(self.hit, minlength=3)
        return (
            f"RayHits({counts[1]} hit occupied, {counts[2]} entered unknown, {counts[0]} met nothing "
            f"at revision {self.revision})"
        )
