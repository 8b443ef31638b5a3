"""Exact voxel traversal in integer arithmetic: what every ray-shooting engine is measured against.

Contract. A coordinate becomes voxel units `u = x / resolution_m` by one float64 division; where that leaves a
non-zero u below 2^-200, it is taken as 2^-200 with its sign (no product of two coordinates then underflows). From
there nothing is rounded. Cells are half-open, `[k, k + 1)` on each axis. A segment passes the cells that contain one
of its points, ends included.

At one parameter t, therefore, an axis that runs upwards enters its next cell exactly at t, one that runs downwards
leaves its cell just after t. Two upward crossings at the same t step diagonally; an upward and a downward one visit
the cell between them, of which the ray has a single point.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

Cell = tuple[int, int, int]
Point = Sequence[float]

_UPWARD, _DOWNWARD = 0, 1
_SMALLEST = 2.0**-200


def to_voxel_units(points_m: ArrayLike, resolution_m: float) -> NDArray[np.float64]:
    """Metres to voxel units: the only rounding of the contract."""
    u = np.asarray(points_m, dtype=np.float64) / np.float64(resolution_m)
    return np.where((u != 0) & (np.abs(u) < _SMALLEST), np.copysign(_SMALLEST, u), u)


def cell_of(point_u: Point) -> Cell:
    """The half-open cell of a point in voxel units."""
    return (math.floor(point_u[0]), math.floor(point_u[1]), math.floor(point_u[2]))


def cut_end(origin_m: Point, end_m: Point, max_range_m: float | None) -> tuple[NDArray[np.float64], bool]:
    """The end of the ray once cut at `max_range_m` (float64, metres, map frame), and whether it was cut."""
    origin = np.asarray(origin_m, dtype=np.float64)
    end = np.asarray(end_m, dtype=np.float64)
    delta = end - origin
    length = math.sqrt(delta[0] * delta[0] + delta[1] * delta[1] + delta[2] * delta[2])
    if max_range_m is None or length <= max_range_m:
        return end, False
    return origin + delta * (np.float64(max_range_m) / length), True


def _as_integers(values: Iterable[float]) -> tuple[list[int], int]:
    """Floats as integers over one common power-of-two denominator."""
    ratios = [float(value).as_integer_ratio() for value in values]
    scale = max(denominator for _, denominator in ratios)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale


def passed_cells(origin_u: Point, end_u: Point) -> list[Cell]:
    """All cells the closed segment has a point in, in order; the first holds the origin, the last the end."""
    integers, scale = _as_integers([*origin_u, *end_u])
    origin, end = integers[:3], integers[3:]
    delta = [e - o for o, e in zip(origin, end, strict=True)]
    common = math.prod(abs(d) for d in delta if d)
    crossings: list[tuple[int, int, int]] = []
    for axis in range(3):
        if delta[axis] == 0:
            continue
        weight = common // abs(delta[axis])
        first, last = origin[axis] // scale, end[axis] // scale
        if delta[axis] > 0:
            planes = range(first + 1, last + 1)
            crossings += [((k * scale - origin[axis]) * weight, _UPWARD, axis) for k in planes]
        else:
            planes = range(first, last, -1)
            crossings += [((origin[axis] - k * scale) * weight, _DOWNWARD, axis) for k in planes]
    crossings.sort()
    cell = [origin[axis] // scale for axis in range(3)]
    cells: list[Cell] = [(cell[0], cell[1], cell[2])]
    for index, (t, phase, axis) in enumerate(crossings):
        cell[axis] += 1 if phase == _UPWARD else -1
        together = index + 1 < len(crossings) and crossings[index + 1][:2] == (t, phase)
        if not together:
            cells.append((cell[0], cell[1], cell[2]))
    return cells


def ray_cells(
    origin_m: Point,
    end_m: Point,
    resolution_m: float,
    max_range_m: float | None = None,
    returned: bool = True,
) -> tuple[list[Cell], Cell | None]:
    """Free cells of one ray and its occupied cell, None where the ray was cut or came back without an echo."""
    end, cut = cut_end(origin_m, end_m, max_range_m)
    cells = passed_cells(to_voxel_units(origin_m, resolution_m).tolist(), to_voxel_units(end, resolution_m).tolist())
    return cells[:-1], None if cut or not returned else cells[-1]


def segment_meets_cell(origin_u: Point, end_u: Point, cell: Cell) -> bool:
    """Whether the closed segment has a point in the half-open cell, by intersecting parameter intervals.

    Independent of `passed_cells`: no stepping, one cell at a time.
    """
    low, high = (Fraction(0), False), (Fraction(1), True)  # (t, open) and (t, closed): ties pick the tighter bound
    for axis in range(3):
        origin, end = Fraction(origin_u[axis]), Fraction(end_u[axis])
        delta = end - origin
        if delta == 0:
            if not cell[axis] <= origin < cell[axis] + 1:
                return False
            continue
        at_floor, at_ceiling = (cell[axis] - origin) / delta, (cell[axis] + 1 - origin) / delta
        if delta > 0:
            low, high = max(low, (at_floor, False)), min(high, (at_ceiling, False))
        else:
            low, high = max(low, (at_ceiling, True)), min(high, (at_floor, True))
    return low[0] < high[0] or (low[0] == high[0] and not low[1] and high[1])


def traversal_margin(origin_u: Point, end_u: Point, cell: Cell) -> Fraction:
    """How robustly a segment passes a cell, in voxels: positive inside, negative beside it, 0 when it only touches.

    The largest value, over the segment's points, of the distance to the cell's nearest face (negative outside: the
    Chebyshev distance to the cell). A segment that is displaced by less than |margin| still passes, or still misses.
    For a ray that runs through, this is its distance to the nearest edge or corner, measured along the axes.
    """
    lines: list[tuple[Fraction, Fraction]] = []
    for axis in range(3):
        origin, end = Fraction(origin_u[axis]), Fraction(end_u[axis])
        lines.append((origin - cell[axis], end - origin))
        lines.append((cell[axis] + 1 - origin, origin - end))
    # The minimum of six linear functions is concave: its maximum is at an end or where two of them cross.
    candidates = {Fraction(0), Fraction(1)}
    for i, (offset_a, slope_a) in enumerate(lines):
        for offset_b, slope_b in lines[:i]:
            if slope_a != slope_b:
                t = (offset_b - offset_a) / (slope_a - slope_b)
                if 0 < t < 1:
                    candidates.add(t)
    return max(min(offset + slope * t for offset, slope in lines) for t in candidates)


def distance_to_boundary(point_u: Point, cell: Cell) -> Fraction:
    """Chebyshev distance in voxels from a point to the surface of a cell, inside or outside."""
    depth = min(
        min(Fraction(point_u[axis]) - cell[axis], cell[axis] + 1 - Fraction(point_u[axis])) for axis in range(3)
    )
    return abs(depth)
