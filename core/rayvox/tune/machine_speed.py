"""Times that can be compared, on a machine that others use as well.

Where one thread works, its processor time counts, which others do not lengthen by taking the core away. They still slow
it down, through caches and memory: so every measurement carries the time that the same insertion took beside it.
"""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import numpy.typing as npt

from rayvox._native import thread_count
from rayvox.occupancy_map import OccupancyMap

_RAYS, _RESOLUTION_M, _REPEATS = 10_000, 0.05, 3


def clock_s() -> float:
    """Seconds of processor time where the kernel works on one thread, of wall-clock where it works on several."""
    return time.process_time() if thread_count() == 1 else time.perf_counter()


def reference_work_s() -> float:
    """Seconds for the insertion of a fixed scan into an empty map; the least of three."""
    seconds = []
    for _ in range(_REPEATS):
        started = clock_s()
        OccupancyMap(_RESOLUTION_M).insert_scan(_points(), max_range_m=20.0)
        seconds.append(clock_s() - started)
    return min(seconds)


@cache
def _points() -> npt.NDArray[np.float32]:
    """Ends on a sphere-like shell of 2 to 5 m: a room's worth of rays."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(_RAYS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach = 3.5 + 1.5 * np.sin(3 * directions[:, :1]) * np.cos(2 * directions[:, 1:2])
    return (reach * directions).astype(np.float32)
