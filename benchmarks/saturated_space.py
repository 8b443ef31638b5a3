"""Steady-state insertion against resolution in a room that was seen from everywhere, for each engine.

    python -m benchmarks.saturated_space [--resolutions-m 0.1 0.05 0.025] [--rays 150000] [--threads 1] [--write NAME]

An empty room of 6 x 5 x 2.8 m; the sensor stands a little elsewhere and its rays point elsewhere in every scan, until
no voxel is left out: then only the walls can still change. (The depth views of the other benchmarks leave unknown
voxels between far rays, however often they are repeated.) All engines get the same scans; only the last are timed.
"""

from __future__ import annotations

import argparse
from statistics import median
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import RayScan

ROOM_M = np.array([6.0, 5.0, 2.8])
NOISE_M = 0.004
TIMED_SCANS = 5


def scan_of_room(rng: np.random.Generator, rays: int) -> tuple[NDArray[np.float64], tuple[float, float, float]]:
    """End points (n, 3) on the walls and the sensor's place, metres."""
    origin = ROOM_M * rng.uniform(0.35, 0.65, 3)
    directions = rng.normal(size=(rays, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    to_wall = ((np.where(directions > 0, ROOM_M, 0.0) - origin) / directions).min(axis=1)
    ends = origin + directions * (to_wall + rng.normal(0.0, NOISE_M, rays))[:, None]
    return ends, tuple(origin.tolist())


def scans_until_saturated(resolution_m: float, rays: int) -> int:
    """Enough that a voxel at the walls is passed twenty times: five misses saturate it."""
    wall_m2 = 2 * (ROOM_M[0] * ROOM_M[1] + ROOM_M[0] * ROOM_M[2] + ROOM_M[1] * ROOM_M[2])
    return max(8, int(np.ceil(20 * wall_m2 / resolution_m**2 / rays)))


def saturated_room(resolution_m: float, timed: int, rays: int = 150_000) -> tuple[list[RayScan], list[RayScan]]:
    """Scans until only the walls change, and `timed` more."""
    rng = np.random.default_rng(6)
    mapping = scans_until_saturated(resolution_m, rays)
    drawn = [scan_of_room(rng, rays) for _ in range(mapping + timed)]
    scans = [RayScan(ends.astype(np.float32), np.array(origin, np.float32)) for ends, origin in drawn]
    return scans[:mapping], scans[mapping:]


def measure(resolution_m: float, rays: int) -> list[dict[str, Any]]:
    """A row per engine; raises if their maps differ."""
    engines = [engine for engine in rayvox.ENGINES if engine != "auto"]
    maps = {engine: rayvox.OccupancyMap(resolution_m) for engine in engines}
    done: dict[str, list[rayvox.ScanStatistics]] = {engine: [] for engine in engines}
    rng, warm_up = np.random.default_rng(6), scans_until_saturated(resolution_m, rays)
    for index in range(warm_up + 2 + TIMED_SCANS):
        ends, origin = scan_of_room(rng, rays)
        for engine, occupancy_map in maps.items():
            taken = engine if index >= warm_up else "dda"
            result = occupancy_map.insert_scan(ends, origin=origin, engine=taken)
            if index >= warm_up + 2:
                done[engine].append(result.statistics)
    first, *others = [occupancy_map.to_bytes() for occupancy_map in maps.values()]
    if any(other != first for other in others):
        raise RuntimeError("the engines' maps differ")
    return [
        {
            "resolution_cm": 100 * resolution_m,
            "engine": engine,
            "ms": 1e3 * median(s.total_s for s in done[engine]),
            "best_ms": 1e3 * min(s.total_s for s in done[engine]),
            "voxel_steps_M": 1e-6 * median(s.voxel_steps for s in done[engine]),
            "bvh_nodes": int(median(s.bvh_node_count for s in done[engine])),
            "voxels_changed": int(median(s.voxels_changed for s in done[engine])),
        }
        for engine in engines
    ]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolutions-m", type=float, nargs="+", default=[0.1, 0.05, 0.025])
    parser.add_argument("--rays", type=int, default=150_000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(arguments.threads)
    header = provenance()
    rows = [row for resolution_m in arguments.resolutions_m for row in measure(resolution_m, arguments.rays)]
    print(header)
    print_table(list(rows[0]), [list(row.values()) for row in rows])
    if arguments.write:
        print("written:", write_results(arguments.write, header, rows))


if __name__ == "__main__":
    main()
