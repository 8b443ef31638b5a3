"""Why OctoMap's map differs from the exact one: each such voxel must be a tie, or so near one that float32 decides.

OctoMap normalises a ray's direction in float32. Its components are off by up to 2^-23 of themselves (difference, then
division), the ratio of two by twice that, so a crossing is displaced across the ray by at most 2^-22 of the length
travelled; half a voxel's edge is rounded to float32 besides. A ray cut at the maximum range also has its new end
rounded to float32. OctoMap stops once the exit of a cell is further than the ray's float32 length, which drops the
last cell before an end that lies on a face.
"""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tests.support.bulk_traversal import Packed, Rays, contains, pack, scan_cells
from tests.support.leaf_comparison import LOG_ODDS_TOLERANCE, LeafDifference
from tests.support.occupancy_oracle import OracleMap
from tests.support.rational_traversal import Cell, distance_to_boundary, segment_meets_cell, traversal_margin

_FLOAT32_DISPLACEMENT = 2.0**-22
_HALF_EDGE_ROUNDING = 1e-7


@dataclass
class ExactScan:
    """One scan's rays with the cells that the exact traversal gives them."""

    rays: Rays
    free: Packed = field(init=False)
    occupied: Packed = field(init=False)
    bound: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self.free, self.occupied = scan_cells(self.rays)
        length = np.linalg.norm(self.rays.ends_u - self.rays.origins_u, axis=1)
        rounded_end = np.where(self.rays.cut, np.abs(self.rays.ends_u).max(axis=1, initial=0.0), 0.0)
        self.bound = _FLOAT32_DISPLACEMENT * (length + rounded_end) + _HALF_EDGE_ROUNDING

    def update_of(self, cell: Cell) -> str:
        """What the exact traversal says of a cell in this scan: "free", "occupied" or "nothing"."""
        key = pack([cell])
        if contains(self.occupied, key)[0]:
            return "occupied"
        return "free" if contains(self.free, key)[0] else "nothing"

    def rays_near(self, cell: Cell) -> NDArray[np.int64]:
        """Rays that come within their bound of a cell, by a float64 slab test that errs on the side of more."""
        origin, delta = self.rays.origins_u, self.rays.ends_u - self.rays.origins_u
        low, high = np.zeros(len(origin)), np.ones(len(origin))
        slack = self.bound + 1e-9
        for axis in range(3):
            below = cell[axis] - slack - origin[:, axis]
            above = cell[axis] + 1 + slack - origin[:, axis]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = np.sort(np.stack([below / delta[:, axis], above / delta[:, axis]]), axis=0)
            flat = delta[:, axis] == 0
            inside = (below <= 0) & (above >= 0)
            low = np.maximum(low, np.where(flat, np.where(inside, 0.0, 2.0), t[0]))
            high = np.minimum(high, np.where(flat, 1.0, t[1]))
        return np.flatnonzero(low <= high + 1e-9)

    def tie(self, ray: int, cell: Cell) -> str | None:
        """ "exact" where the ray touches the cell's boundary or ends on it, "near" within the bound, else None."""
        origin, end = self.rays.origins_u[ray].tolist(), self.rays.ends_u[ray].tolist()
        nearest = min(abs(traversal_margin(origin, end, cell)), distance_to_boundary(end, cell))
        if nearest == 0:
            return "exact"
        return "near" if nearest <= self.bound[ray] else None

    def alternative(self, cell: Cell) -> tuple[str, str] | None:
        """What float32 may make of the cell instead, and the kind of tie; None where the exact answer is robust."""
        update = self.update_of(cell)
        if update == "occupied":
            return None
        near = self.rays_near(cell)
        if update == "nothing":
            for ray in near.tolist():
                if kind := self.tie(ray, cell):
                    return "free", kind
            return None
        kinds = []
        for ray in near.tolist():
            ends_here = tuple(np.floor(self.rays.ends_u[ray]).astype(int).tolist()) == cell
            if ends_here or not segment_meets_cell(
                self.rays.origins_u[ray].tolist(), self.rays.ends_u[ray].tolist(), cell
            ):
                continue
            kind = self.tie(ray, cell)
            if kind is None:
                return None
            kinds.append(kind)
        return "nothing", "exact" if "exact" in kinds else "near"


def _log_odds_after(updates: tuple[str, ...], model: OracleMap) -> np.float32:
    value, known = np.float32(0), False
    for update in updates:
        if update != "nothing":
            step = model.miss if update == "free" else model.hit
            value, known = min(max(value + step, model.clamp_min), model.clamp_max), True
    return value if known else np.float32(np.nan)


def _same(a: np.float32, b: np.float32) -> bool:
    return bool((np.isnan(a) and np.isnan(b)) or abs(a - b) <= LOG_ODDS_TOLERANCE)


def explain_difference(difference: LeafDifference, scans: list[ExactScan], model: OracleMap) -> Counter[str]:
    """Counts of "exact" and "near" ties and "unexplained" voxels, of a difference between the exact map and OctoMap's.

    A voxel is explained when OctoMap's log-odds there follow from the scans with some of the tied ones decided
    otherwise.
    """
    counts: Counter[str] = Counter()
    for row, theirs in zip(difference.cells.tolist(), difference.theirs, strict=True):
        cell = (row[0], row[1], row[2])
        choices, kinds = [], []
        for scan in scans:
            update, other = scan.update_of(cell), scan.alternative(cell)
            choices.append((update,) if other is None else (update, other[0]))
            kinds += [] if other is None else [other[1]]
        possible = any(_same(_log_odds_after(updates, model), theirs) for updates in itertools.product(*choices))
        if not kinds or not possible:
            counts["unexplained"] += 1
        else:
            counts["exact" if "exact" in kinds else "near"] += 1
    return counts
