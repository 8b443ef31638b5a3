"""A brute-force occupancy map: one sorted array of voxels, OctoMap's float32 log-odds, pruned only when read out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.support.bulk_traversal import Packed, pack, prepare_rays, scan_cells, sorted_unique, unpack


@dataclass(frozen=True)
class Leaves:
    """Octree leaves: lowest finest-level key (n,3) int64, depth (n,) uint8 (0 = root), log-odds (n,) float32."""

    keys: NDArray[np.int64]
    depth: NDArray[np.uint8]
    log_odds: NDArray[np.float32]
    tree_depth: int = 16

    def __len__(self) -> int:
        return len(self.depth)

    def sorted(self) -> Leaves:
        """The same leaves in the order of their keys."""
        order = np.argsort(pack(self.keys), kind="stable")
        return Leaves(self.keys[order], self.depth[order], self.log_odds[order], self.tree_depth)

    def expanded(self) -> tuple[Packed, NDArray[np.float32]]:
        """Every finest-level voxel inside the leaves, packed and sorted, with its log-odds."""
        cells, values = [], []
        for level in np.unique(self.depth):
            here = self.depth == level
            side = np.arange(1 << (self.tree_depth - int(level)))
            block = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
            cells.append((self.keys[here][:, None, :] + block[None, :, :]).reshape(-1, 3))
            values.append(np.repeat(self.log_odds[here], len(block)))
        if not cells:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.float32)
        packed, log_odds = pack(np.concatenate(cells)), np.concatenate(values)
        order = np.argsort(packed, kind="stable")
        return packed[order], log_odds[order]


def log_odds_of(probability: float) -> np.float32:
    """A probability's log-odds, computed in float64, kept in float32."""
    return np.float32(math.log(probability / (1.0 - probability)))


_HIT, _MISS, _CLAMP_MIN, _CLAMP_MAX = (log_odds_of(p) for p in (0.7, 0.4, 0.1192, 0.971))


@dataclass
class OracleMap:
    """Occupancy of every observed voxel; what an occupancy octree must contain after the same scans."""

    resolution_m: float
    tree_depth: int = 16
    hit: np.float32 = _HIT
    miss: np.float32 = _MISS
    clamp_min: np.float32 = _CLAMP_MIN
    clamp_max: np.float32 = _CLAMP_MAX
    voxels: Packed = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    log_odds: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, dtype=np.float32))

    def insert_scan(
        self,
        points_m: ArrayLike,
        origin_m: ArrayLike,
        max_range_m: float | None = None,
        no_return_m: ArrayLike | None = None,
    ) -> None:
        """One scan in the map frame, traversed exactly."""
        self.insert_cells(*scan_cells(prepare_rays(origin_m, points_m, self.resolution_m, max_range_m, no_return_m)))

    def insert_cells(self, free: Packed, occupied: Packed) -> None:
        """One scan's free and occupied cells: disjoint, each at most once."""
        merged = sorted_unique(np.concatenate([self.voxels, free, occupied]))
        log_odds = np.zeros(len(merged), dtype=np.float32)
        log_odds[np.searchsorted(merged, self.voxels)] = self.log_odds
        for cells, update in ((free, self.miss), (occupied, self.hit)):
            at = np.searchsorted(merged, cells)
            log_odds[at] = np.clip(log_odds[at] + update, self.clamp_min, self.clamp_max)
        self.voxels, self.log_odds = merged, log_odds

    def leaves(self) -> Leaves:
        """Pruned leaves: eight siblings of one value become their parent, level by level."""
        if not len(self.voxels):
            return Leaves(np.zeros((0, 3), np.int64), np.zeros(0, np.uint8), np.zeros(0, np.float32), self.tree_depth)
        keys, values = unpack(self.voxels), self.log_odds
        done: list[tuple[NDArray[np.int64], int, NDArray[np.float32]]] = []
        for level in range(self.tree_depth, 0, -1):
            shift = self.tree_depth - level + 1
            parent = pack((keys >> shift) << shift)
            order = np.argsort(parent, kind="stable")
            keys, values, parent = keys[order], values[order], parent[order]
            begins = np.append(True, parent[1:] != parent[:-1])
            first, inverse = np.flatnonzero(begins), np.cumsum(begins) - 1
            count = np.diff(np.append(first, len(parent)))
            differs = np.add.reduceat((values != values[first][inverse]).astype(np.int64), first)
            merges = (count == 8) & (differs == 0)
            stays = ~merges[inverse]
            done.append((keys[stays], level, values[stays]))
            keys, values = unpack(parent[first[merges]]), values[first[merges]]
            if not len(keys):
                break
        else:
            done.append((keys, 0, values))
        return Leaves(
            np.concatenate([k for k, _, _ in done]),
            np.concatenate([np.full(len(k), level, dtype=np.uint8) for k, level, _ in done]),
            np.concatenate([v for _, _, v in done]),
            self.tree_depth,
        ).sorted()
