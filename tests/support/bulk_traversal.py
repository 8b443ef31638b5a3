"""The exact traversal for whole scans: float64 decides where it can, integers where it cannot.

Crossing parameters are computed in float64 with a known error bound. A ray whose crossings are all further apart than
that bound is ordered correctly by them; every other ray goes through `rational_traversal`. The result is exact for
all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.support.rational_traversal import cut_end, passed_cells, to_voxel_units

# Three roundings of 2^-53 relative each in (k - o) / (e - o), t <= 1, two of them compared: 6.7e-16.
_SAFE_GAP = 1e-15
_CROSSINGS_AT_ONCE = 2_000_000
_KEY_BITS = 21
_KEY_OFFSET = 1 << (_KEY_BITS - 1)

Packed = NDArray[np.int64]


@dataclass(frozen=True)
class Rays:
    """Rays of one scan in voxel units, after the max-range cut."""

    origins_u: NDArray[np.float64]
    ends_u: NDArray[np.float64]
    marks_end: NDArray[np.bool_]
    cut: NDArray[np.bool_]


def pack(cells: ArrayLike) -> Packed:
    """Cells (n,3), |k| <= 2^20, as one int64 each; the order of the packed keys is lexicographic."""
    keys = np.asarray(cells, dtype=np.int64).reshape(-1, 3) + _KEY_OFFSET
    if keys.size and (keys.min() < 0 or keys.max() >= 2 * _KEY_OFFSET):
        raise OverflowError("a cell does not fit 21 bits per axis")
    return (keys[:, 0] << (2 * _KEY_BITS)) | (keys[:, 1] << _KEY_BITS) | keys[:, 2]


def unpack(packed: ArrayLike) -> NDArray[np.int64]:
    """Inverse of `pack`: (n,3) int64."""
    keys = np.asarray(packed, dtype=np.int64)
    mask = (1 << _KEY_BITS) - 1
    return np.stack([keys >> (2 * _KEY_BITS), (keys >> _KEY_BITS) & mask, keys & mask], axis=-1) - _KEY_OFFSET


def prepare_rays(
    origin_m: ArrayLike,
    points_m: ArrayLike,
    resolution_m: float,
    max_range_m: float | None = None,
    no_return_m: ArrayLike | None = None,
) -> Rays:
    """Rays of a scan given in the map frame: one origin, hits (n,3), and ends (k,3) of rays without return."""
    hits = np.asarray(points_m, dtype=np.float64).reshape(-1, 3)
    silent = np.zeros((0, 3)) if no_return_m is None else np.asarray(no_return_m, dtype=np.float64).reshape(-1, 3)
    origin = np.asarray(origin_m, dtype=np.float64)
    ends = np.concatenate([hits, silent])
    delta = ends - origin
    length = np.sqrt(delta[:, 0] * delta[:, 0] + delta[:, 1] * delta[:, 1] + delta[:, 2] * delta[:, 2])
    cut = np.zeros(len(ends), dtype=bool) if max_range_m is None else length > max_range_m
    for index in np.flatnonzero(cut):
        ends[index], _ = cut_end(origin.tolist(), ends[index].tolist(), max_range_m)
    marks_end = ~cut
    marks_end[len(hits) :] = False
    ends_u = to_voxel_units(ends, resolution_m)
    origins_u = np.broadcast_to(to_voxel_units(origin, resolution_m), ends_u.shape)
    return Rays(origins_u, ends_u, marks_end, cut)


def sorted_unique(packed: Packed) -> Packed:
    """np.unique hashes int64, which these keys make an order of magnitude slower than sorting."""
    ordered = np.sort(packed)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered


def contains(ordered: Packed, wanted: Packed) -> NDArray[np.bool_]:
    if not len(ordered):
        return np.zeros(len(wanted), dtype=bool)
    found: NDArray[np.bool_] = ordered[np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)] == wanted
    return found


def _chunks(crossings: NDArray[np.int64]) -> Iterator[slice]:
    boundaries = np.cumsum(crossings)
    start = 0
    while start < len(crossings):
        before = boundaries[start - 1] if start else 0
        stop = int(np.searchsorted(boundaries, before + _CROSSINGS_AT_ONCE, side="right"))
        stop = min(max(stop, start + 1), start + 65_535)
        yield slice(start, stop)
        start = stop


def _crossings_of_axis(
    origin: NDArray[np.float64], delta: NDArray[np.float64], start: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(ray, t) of every plane crossing on one axis."""
    ray = np.repeat(np.arange(len(origin)), counts)
    nth = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
    plane = np.where(delta[ray] > 0, start[ray] + 1 + nth, start[ray] - nth)
    return ray, (plane - origin[ray]) / delta[ray]


def _free_of_chunk(origins: NDArray[np.float64], ends: NDArray[np.float64]) -> Packed:
    starts, delta = np.floor(origins).astype(np.int64), ends - origins
    # Downward axes that start on a plane all leave it at once: one step to take before any crossing is ordered.
    at_once = (delta < 0) & (starts == origins)
    free = [pack(starts[at_once.any(axis=1)])]
    starts = starts - at_once
    moves = np.floor(ends).astype(np.int64) - starts
    counts = np.abs(moves)
    per_axis = [_crossings_of_axis(origins[:, a], delta[:, a], starts[:, a], counts[:, a]) for a in range(3)]
    ray = np.concatenate([r for r, _ in per_axis]).astype(np.uint16)
    t = np.concatenate([t for _, t in per_axis])
    axis = np.repeat(np.arange(3, dtype=np.int8), [len(r) for r, _ in per_axis])
    order = np.argsort(t)
    order = order[np.argsort(ray[order], kind="stable")]
    ray, t, axis = ray[order].astype(np.int64), t[order], axis[order]

    same_ray = ray[1:] == ray[:-1]
    undecided = np.zeros(len(origins), dtype=bool)
    undecided[ray[1:][same_ray & (np.diff(t) < _SAFE_GAP)]] = True

    total = counts.sum(axis=1)
    first_crossing = np.cumsum(total) - total
    cells = np.empty((len(ray), 3), dtype=np.int64)
    for a in range(3):
        crossed = axis == a
        before = np.cumsum(crossed) - crossed  # exclusive: a crossing's cell is the one it leaves
        at_start = np.append(before, before[-1] + crossed[-1])[first_crossing] if len(ray) else first_crossing
        cells[:, a] = starts[ray, a] + np.sign(moves[ray, a]) * (before - at_start[ray])
    free.append(pack(cells[~undecided[ray]]))
    for index in np.flatnonzero(undecided):
        free.append(pack(passed_cells(origins[index].tolist(), ends[index].tolist())[:-1]))
    return sorted_unique(np.concatenate(free))


def scan_cells(rays: Rays) -> tuple[Packed, Packed]:
    """Free and occupied cells of one scan, packed, sorted and disjoint: occupied wins."""
    ends = np.floor(rays.ends_u).astype(np.int64)
    occupied = sorted_unique(pack(ends[rays.marks_end]))
    crossings = np.abs(ends - np.floor(rays.origins_u).astype(np.int64)).sum(axis=1)
    free = [_free_of_chunk(rays.origins_u[part], rays.ends_u[part]) for part in _chunks(crossings)]
    every_free = sorted_unique(np.concatenate(free)) if free else np.zeros(0, dtype=np.int64)
    return every_free[~contains(occupied, every_free)], occupied
