"""How fast the machine is right now, by a fixed piece of work.

A machine that others use as well is twice as slow at one time as at another. Every measurement carries the time that
the same insertion took beside it, so that times from different moments can be compared.
"""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import numpy.typing as npt

from rayvox.occupancy_map import OccupancyMap

_RAYS, _RESOLUTION_M, _REPEATS = 20_000, 0.05, 3


def reference_work_s() -> float:
    """Seconds for the insertion of a fixed scan into an empty map; the least of three."""
    seconds = []
    for _ in range(_REPEATS):
        started = time.perf_counter()
        OccupancyMap(_RESOLUTION_M).insert_scan(_points(), max_range_m=20.0)
        seconds.append(time.perf_counter() - started)
    return min(seconds)


@cache
def _points() -> npt.NDArray[np.float32]:
    """Ends on a sphere-like shell of 2 to 5 m: a room's worth of rays."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(_RAYS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach = 3.5 + 1.5 * np.sin(3 * directions[:, :1]) * np.cos(2 * directions[:, 1:2])
    return (reach * directions).astype(np.float32)
