"""What changed in a map between two revisions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rayvox_client.errors import MalformedAnswerError
from rayvox_client.frame import Frame

if TYPE_CHECKING:
    from rayvox_client.map_copy import MapCopy

MAX_DEPTH = 21


@dataclass(frozen=True, eq=False, repr=False)
class MapChanges:
    """Regions that were rewritten, and all leaves that they hold now.

    A key is the lowest finest-level cell of its leaf or region: cell k covers [k r, (k+1) r) metres, r the resolution;
    a leaf at depth d is 2**(depth - d) cells wide.

    Attributes:
        since, revision: from and to which revision of the map.
        full: the leaves are the whole map; whatever was held before is void.
        resolution_m, depth: of the map.
        region_keys: (m,3) int32. region_depth: (m,) uint8.
        keys: (n,3) int32. leaf_depth: (n,) uint8. log_odds: (n,) float32.
    """

    since: int
    revision: int
    full: bool
    resolution_m: float
    depth: int
    region_keys: NDArray[np.int32]
    region_depth: NDArray[np.uint8]
    keys: NDArray[np.int32]
    leaf_depth: NDArray[np.uint8]
    log_odds: NDArray[np.float32]

    @classmethod
    def from_frame(cls, frame: Frame) -> MapChanges:
        """Read a `changes` frame; MalformedAnswerError when its arrays do not fit together."""
        fields = frame.expect("changes").fields
        changes = cls(
            since=fields.integer("since"),
            revision=fields.integer("revision"),
            full=fields.boolean("full"),
            resolution_m=fields.number("resolution_m"),
            depth=fields.integer("depth"),
            region_keys=frame.array("region_keys", "<i4", columns=3),
            region_depth=frame.array("region_depth", "|u1"),
            keys=frame.array("keys", "<i4", columns=3),
            leaf_depth=frame.array("leaf_depth", "|u1"),
            log_odds=frame.array("log_odds", "<f4"),
        )
        changes._check()
        return changes

    def _check(self) -> None:
        if not 1 <= self.depth <= MAX_DEPTH or self.resolution_m <= 0:
            raise MalformedAnswerError(f"changes frame: depth {self.depth}, resolution {self.resolution_m} m")
        if len(self.region_keys) != len(self.region_depth):
            raise MalformedAnswerError("changes frame: region_keys and region_depth differ in length")
        if not len(self.keys) == len(self.leaf_depth) == len(self.log_odds):
            raise MalformedAnswerError("changes frame: keys, leaf_depth and log_odds differ in length")
        limit = 1 << (self.depth - 1)
        for name, keys, depth in (
            ("region", self.region_keys, self.region_depth),
            ("leaf", self.keys, self.leaf_depth),
        ):
            if depth.size and int(depth.max()) > self.depth:
                raise MalformedAnswerError(f"changes frame: a {name} at depth {depth.max()} of {self.depth}")
            if keys.size and not (-limit <= int(keys.min()) and int(keys.max()) < limit):
                raise MalformedAnswerError(f"changes frame: a {name} key beyond the octree's range of +-{limit} cells")

    def apply_to(self, copy: MapCopy) -> None:
        """Bring a local copy to `revision`; see `MapCopy.apply`."""
        copy.apply(self)

    def __repr__(self) -> str:
        extent = "whole map" if self.full else f"{len(self.region_depth)} regions"
        return f"MapChanges({self.since} -> {self.revision}: {extent}, {len(self.keys)} leaves)"


def morton_codes(keys: NDArray[Any], depth: int) -> NDArray[np.uint64]:
    """(n,) uint64 Z-order codes of finest-level keys (n,3): an octree node's cells are one contiguous range.

    `keys` must lie within +-2**(depth - 1).
    """
    shifted = (keys.astype(np.int64) + (1 << (depth - 1))).astype(np.uint64)
    code = np.zeros(len(keys), np.uint64)
    for axis in range(3):
        spread = shifted[:, axis]
        for shift, mask in _SPREAD:
            spread = (spread | (spread << shift)) & mask
        code |= spread << np.uint64(axis)
    return code


# Each step halves the runs of neighbouring bits, until two zero bits stand between any two of the 21.
_SPREAD = [
    (np.uint64(32), np.uint64(0x001F00000000FFFF)),
    (np.uint64(16), np.uint64(0x001F0000FF0000FF)),
    (np.uint64(8), np.uint64(0x100F00F00F00F00F)),
    (np.uint64(4), np.uint64(0x10C30C30C30C30C3)),
    (np.uint64(2), np.uint64(0x1249249249249249)),
]


def node_cells(node_depth: NDArray[np.uint8], depth: int) -> NDArray[np.uint64]:
    """(n,) uint64: how many finest-level cells a node at each depth holds, 8**(depth - node_depth)."""
    return np.uint64(1) << (np.uint64(3) * (np.uint64(depth) - node_depth.astype(np.uint64)))
