"""A local copy of a map, kept up by its changes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rayvox_client.errors import MalformedAnswerError, OutOfStepError
from rayvox_client.map_changes import MapChanges, morton_codes, node_cells
from rayvox_client.validation import points_array


class MapCopy:
    """The leaves of a map at one revision, in Z order.

    Starts empty at revision 0; learns resolution and depth from the first change. Not safe to read from one thread
    while another applies a change.

    Attributes:
        revision: the map's revision that the copy shows.
        resolution_m, depth: of the map; None before the first change.
        keys: (n,3) int64, lowest finest-level cell of each leaf; cell k covers [k r, (k+1) r) metres.
        leaf_depth: (n,) uint8; a leaf at depth d is 2**(depth - d) cells wide.
        log_odds: (n,) float32.
    """

    def __init__(self) -> None:
        self.revision = 0
        self.resolution_m: float | None = None
        self.depth: int | None = None
        self.keys: NDArray[np.int64] = np.empty((0, 3), np.int64)
        self.leaf_depth: NDArray[np.uint8] = np.empty(0, np.uint8)
        self.log_odds: NDArray[np.float32] = np.empty(0, np.float32)
        self._codes: NDArray[np.uint64] = np.empty(0, np.uint64)

    def apply(self, changes: MapChanges) -> None:
        """Drop what lies in the changed regions, add their leaves, move to the change's revision.

        A change that leads no further than the copy already is does nothing.

        Raises:
            OutOfStepError: the change starts after the copy's revision, or belongs to another map; copy unchanged.
            MalformedAnswerError: a leaf kept and a leaf added would overlap; copy unchanged.
        """
        if not changes.full:
            if changes.since > self.revision:
                raise OutOfStepError(f"the change starts at revision {changes.since}, the copy is at {self.revision}")
            if self.depth is not None and (changes.depth, changes.resolution_m) != (self.depth, self.resolution_m):
                raise OutOfStepError(f"{changes!r} belongs to a map of another resolution or depth")
            if changes.revision <= self.revision:
                return
        self._replace(changes, self._kept(changes))
        self.resolution_m, self.depth, self.revision = changes.resolution_m, changes.depth, changes.revision

    def _kept(self, changes: MapChanges) -> NDArray[np.bool_]:
        if changes.full or not len(self._codes):
            return np.zeros(len(self._codes), np.bool_)
        starts = morton_codes(changes.region_keys, changes.depth)
        ends = starts + node_cells(changes.region_depth, changes.depth)
        # A region within one larger leaf holds no leaf; it could only be mistaken for one that starts at the same cell.
        first = np.minimum(np.searchsorted(self._codes, starts), len(self._codes) - 1)
        within_leaf = (self._codes[first] == starts) & (self.leaf_depth[first] < changes.region_depth)
        starts, ends = starts[~within_leaf], ends[~within_leaf]
        # +1 where a region's leaves begin, -1 where they end: above zero means inside some region.
        marks = np.zeros(len(self._codes) + 1, np.int64)
        np.add.at(marks, np.searchsorted(self._codes, starts), 1)
        np.add.at(marks, np.searchsorted(self._codes, ends), -1)
        kept: NDArray[np.bool_] = np.cumsum(marks[:-1]) == 0
        return kept

    def _replace(self, changes: MapChanges, kept: NDArray[np.bool_]) -> None:
        added_codes = morton_codes(changes.keys, changes.depth)
        order = np.argsort(added_codes, kind="stable")
        kept_codes = self._codes[kept]
        places = np.searchsorted(kept_codes, added_codes[order]) + np.arange(len(order))
        from_copy = np.ones(len(kept_codes) + len(order), np.bool_)
        from_copy[places] = False

        def merged(held: NDArray[Any], added: NDArray[Any]) -> NDArray[Any]:
            out = np.empty((len(from_copy), *held.shape[1:]), held.dtype)
            out[from_copy] = held[kept]
            out[places] = added[order]
            return out

        codes, leaf_depth = merged(self._codes, added_codes), merged(self.leaf_depth, changes.leaf_depth)
        if (codes[:-1] + node_cells(leaf_depth[:-1], changes.depth) > codes[1:]).any():
            raise MalformedAnswerError(f"{changes!r}: its leaves overlap each other or leaves outside its regions")
        self.keys = merged(self.keys, changes.keys)
        self.log_odds = merged(self.log_odds, changes.log_odds)
        self.leaf_depth, self._codes = leaf_depth, codes

    @property
    def edge_m(self) -> NDArray[np.float64]:
        """(n,) edge of each leaf, metres."""
        if self.resolution_m is None or self.depth is None:
            return np.empty(0)
        return self.resolution_m * np.exp2(self.depth - self.leaf_depth.astype(np.float64))

    @property
    def centers_m(self) -> NDArray[np.float64]:
        """(n,3) centre of each leaf, map frame, metres."""
        return self.keys * (self.resolution_m or 1.0) + 0.5 * self.edge_m[:, None]

    def log_odds_at(self, points: ArrayLike) -> NDArray[np.float32]:
        """(n,) float32 log-odds at (n,3) points, map frame, metres; NaN where unknown.

        Raises:
            InvalidInputError: another shape, or not finite.
        """
        asked = points_array(points, "points", allow_empty=True).astype(np.float64)
        answer = np.full(len(asked), np.nan, np.float32)
        if self.resolution_m is None or self.depth is None or not len(self._codes):
            return answer
        cells: NDArray[Any] = np.floor(asked / self.resolution_m)
        inside = (np.abs(cells + 0.5) < 1 << (self.depth - 1)).all(axis=1)
        codes = morton_codes(cells[inside], self.depth)
        leaf = np.searchsorted(self._codes, codes, side="right").astype(np.int64) - 1
        # codes below every leaf give leaf -1, whose unsigned distance wraps far beyond any leaf's size.
        within = codes - self._codes[leaf] < node_cells(self.leaf_depth[leaf], self.depth)
        answer[inside] = np.where(within, self.log_odds[leaf], np.float32(np.nan))
        return answer

    def __len__(self) -> int:
        return len(self._codes)

    def __repr__(self) -> str:
        if self.resolution_m is None:
            return "MapCopy(empty)"
        return f"MapCopy({len(self)} leaves of {self.resolution_m} m and up, revision {self.revision})"
