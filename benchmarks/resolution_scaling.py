"""Insertion time against resolution, per engine: does steady state cost what changes, or the volume crossed?

    python -m benchmarks.resolution_scaling [--passes N] [--write NAME]

The building's depth views at 10, 5, 2.5 and 1.25 cm, first scans and steady state (the last half of the passes), all
cores. The exponent p is the slope of log time over log (1 / resolution): crossing twice as many voxels per ray gives
p = 1, twice as many per axis of the volume p = 3.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from statistics import median
from typing import Any

import numpy as np
import rayvox
from rayvox.occupancy_map import ENGINES, Engine

from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import Workload, depth_views

RESOLUTIONS_M = (0.1, 0.05, 0.025, 0.0125)


def time_engine(workload: Workload, engine: Engine, passes: int) -> dict[str, float]:
    """Median milliseconds of first scans and in steady state, and voxels changed per scan there."""
    seconds: dict[str, list[float]] = {"first": [], "steady": []}
    changed: list[int] = []

    def insert(occupancy_map: rayvox.OccupancyMap, index: int, kind: str) -> None:
        scan = workload.scans[index]
        start = time.perf_counter()
        result = occupancy_map.insert_scan(
            scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=workload.max_range_m, engine=engine
        )
        seconds[kind].append(time.perf_counter() - start)
        if kind == "steady":
            changed.append(result.statistics.voxels_changed)

    for index in range(len(workload.scans)):
        insert(rayvox.OccupancyMap(workload.resolution_m), index, "first")
    occupancy_map = rayvox.OccupancyMap(workload.resolution_m)
    for _ in range(passes):
        for index in range(len(workload.scans)):
            insert(occupancy_map, index, "steady")
    half = len(changed) // 2
    return {
        "first_ms": 1e3 * median(seconds["first"]),
        "steady_ms": 1e3 * median(seconds["steady"][half:]),
        "changed": float(median(changed[half:])),
    }


def exponent(resolutions_m: Sequence[float], values: Sequence[float]) -> float:
    """Least-squares slope of log value over log (1 / resolution)."""
    slope: float = np.polyfit(-np.log(resolutions_m), np.log(values), 1)[0]
    return float(slope)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Insertion time against resolution, per engine.")
    parser.add_argument("--passes", type=int, default=12)
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    header, results, rows = provenance(), [], []
    workloads = [depth_views(resolution_m) for resolution_m in RESOLUTIONS_M]
    for engine in ENGINES:
        times: list[dict[str, Any]] = [time_engine(workload, engine, arguments.passes) for workload in workloads]
        for kind in ("first_ms", "steady_ms", "changed"):
            values = [t[kind] for t in times]
            p = exponent(RESOLUTIONS_M, values)
            rows.append([engine, kind, *values, p])
            results.append({"engine": engine, "kind": kind, "values": values, "exponent": p})
    print(header)
    print_table(["engine", "", *(f"{100 * r:g} cm" for r in RESOLUTIONS_M), "exponent"], rows)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
