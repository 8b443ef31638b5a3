"""Two sets of octree leaves against each other: differing voxels, and leaves that no differing voxel accounts for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.support.bulk_traversal import contains, pack, sorted_unique
from tests.support.occupancy_oracle import Leaves

LOG_ODDS_TOLERANCE = 1e-5
_KEY_OFFSET = 1 << 20
_MOST_VOXELS = 20_000_000
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)

Codes = NDArray[np.int64]


def morton(cells: NDArray[np.int64]) -> Codes:
    """Cells (n,3), |k| <= 2^20, in octree order: every octree node is one contiguous range."""
    code = np.zeros(len(cells), dtype=np.int64)
    for axis in range(3):
        bits = cells[:, axis] + _KEY_OFFSET
        for shift, mask in _SPREAD:
            bits = (bits | (bits << shift)) & mask
        code |= bits << axis
    return code


def cells_of(codes: Codes) -> NDArray[np.int64]:
    """Inverse of `morton`."""
    cells = np.empty((len(codes), 3), dtype=np.int64)
    for axis in range(3):
        bits = (codes >> axis) & _SPREAD[-1][1]
        for (shift, _), (_, mask) in zip(_SPREAD[::-1], (*_SPREAD[-2::-1], (0, 0x1FFFFF)), strict=True):
            bits = (bits | (bits >> shift)) & mask
        cells[:, axis] = bits - _KEY_OFFSET
    return cells


@dataclass(frozen=True)
class LeafDifference:
    """Voxels whose log-odds differ (NaN: unknown there), in octree order, and leaves that differ for no such reason."""

    cells: NDArray[np.int64]
    ours: NDArray[np.float32]
    theirs: NDArray[np.float32]
    unaccounted_leaves: int


def _without_twin(leaves: Leaves, other: Leaves) -> NDArray[np.bool_]:
    mine, theirs = pack(leaves.keys), pack(other.keys)
    if not len(theirs):
        return np.ones(len(mine), dtype=bool)
    at = np.minimum(np.searchsorted(theirs, mine), len(theirs) - 1)
    same_place = (theirs[at] == mine) & (other.depth[at] == leaves.depth)
    alike: NDArray[np.bool_] = same_place & (np.abs(other.log_odds[at] - leaves.log_odds) <= LOG_ODDS_TOLERANCE)
    return ~alike


def _subset(leaves: Leaves, chosen: NDArray[np.bool_]) -> tuple[Codes, Codes, NDArray[np.float32]]:
    """(first code, number of voxels, log-odds) of the chosen leaves, in octree order."""
    first = morton(leaves.keys[chosen])
    size = np.int64(8) ** (leaves.tree_depth - leaves.depth[chosen].astype(np.int64))
    order = np.argsort(first)
    return first[order], size[order], leaves.log_odds[chosen][order]


def _voxel_values(first: Codes, size: Codes, values: NDArray[np.float32], at: Codes) -> NDArray[np.float32]:
    if not len(first):
        return np.full(len(at), np.nan, dtype=np.float32)
    leaf = np.maximum(np.searchsorted(first, at, side="right") - 1, 0)
    inside = (at >= first[leaf]) & (at < first[leaf] + size[leaf])
    return np.where(inside, values[leaf], np.float32(np.nan))


def _voxels(first: Codes, size: Codes) -> Codes:
    total = int(size.sum())
    if total > _MOST_VOXELS:
        raise AssertionError(f"the maps differ wholesale: {len(first)} leaves of one, {total} voxels")
    return np.repeat(first - (np.cumsum(size) - size), size) + np.arange(total)


def _differing_inside(first: Codes, size: Codes, differing: Codes) -> NDArray[np.bool_]:
    return np.searchsorted(differing, first) < np.searchsorted(differing, first + size)


def _inside_differing(first: Codes, other_first: Codes, other_size: Codes, differing: Codes) -> NDArray[np.bool_]:
    """Whether each place lies in a leaf of the other map that has a differing voxel somewhere."""
    if not len(other_first):
        return np.zeros(len(first), dtype=bool)
    leaf = np.maximum(np.searchsorted(other_first, first, side="right") - 1, 0)
    inside = (first >= other_first[leaf]) & (first < other_first[leaf] + other_size[leaf])
    return inside & _differing_inside(other_first, other_size, differing)[leaf]


def compare_leaves(ours: Leaves, theirs: Leaves) -> LeafDifference:
    """Where two maps differ. Both must be sorted by key (`Leaves.sorted`)."""
    a_first, a_size, a_values = _subset(ours, _without_twin(ours, theirs))
    b_first, b_size, b_values = _subset(theirs, _without_twin(theirs, ours))
    at = sorted_unique(np.concatenate([_voxels(a_first, a_size), _voxels(b_first, b_size)]))
    a, b = _voxel_values(a_first, a_size, a_values, at), _voxel_values(b_first, b_size, b_values, at)
    differs = (np.isnan(a) != np.isnan(b)) | (np.abs(a - b) > LOG_ODDS_TOLERANCE)
    differing = at[differs]
    # A leaf may differ because a voxel in it does, or because one elsewhere in its merged counterpart does.
    a_ok = _differing_inside(a_first, a_size, differing) | _inside_differing(a_first, b_first, b_size, differing)
    b_ok = _differing_inside(b_first, b_size, differing) | _inside_differing(b_first, a_first, a_size, differing)
    return LeafDifference(cells_of(differing), a[differs], b[differs], int((~a_ok).sum() + (~b_ok).sum()))


def assert_same_leaves(ours: Leaves, theirs: Leaves) -> None:
    """Same places, same sizes, log-odds within the tolerance; otherwise says where the first differences are."""
    difference = compare_leaves(ours, theirs)
    if len(difference.cells) or difference.unaccounted_leaves:
        first = list(zip(difference.cells.tolist(), difference.ours, difference.theirs, strict=True))[:10]
        raise AssertionError(
            f"{len(difference.cells)} voxels differ, {difference.unaccounted_leaves} leaves differ in size only; first "
            f"(cell, ours, theirs): {first}"
        )
    assert len(ours) == len(theirs)
    assert contains(pack(ours.keys), pack(theirs.keys)).all()
