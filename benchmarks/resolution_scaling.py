"""Insertion time against resolution, per engine: does steady state cost what changes, or the volume crossed?

    python -m benchmarks.resolution_scaling [--mapping N] [--write NAME]

A depth camera wanders about the building at 10, 5, 2.5 and 1.25 cm, all cores. First: scans into empty maps. Mapped:
new scans of an area that N scans before them have mapped. Repeated: six scans inserted over and over, as no robot does,
but as the insertion benchmark's steady state is: at 1.25 cm, which such a camera's rays do not fill, unknown cells stay
between them, and every scan has to find out that it misses them.
The exponent is the slope of log time over log (1 / resolution); crossing cells one by one costs 1.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from statistics import median

import numpy as np
import rayvox
from rayvox.occupancy_map import ENGINES, Engine

from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import RayScan, Workload, depth_views, wandering_views

RESOLUTIONS_M = (0.1, 0.05, 0.025, 0.0125)


def time_engine(
    scans: Sequence[RayScan], repeated: Workload, resolution_m: float, engine: Engine, mapping: int
) -> dict[str, float]:
    """Median milliseconds per kind, and voxels changed per scan of the mapped area."""

    def insert(occupancy_map: rayvox.OccupancyMap, scan: RayScan, how: Engine = engine) -> tuple[float, int]:
        start = time.perf_counter()
        result = occupancy_map.insert_scan(
            scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=repeated.max_range_m, engine=how
        )
        return 1e3 * (time.perf_counter() - start), result.statistics.voxels_changed

    first = [insert(rayvox.OccupancyMap(resolution_m), scan)[0] for scan in scans[mapping:]]
    mapped = rayvox.OccupancyMap(resolution_m)
    for scan in scans[:mapping]:
        insert(mapped, scan, "auto")
    wandered = [insert(mapped, scan) for scan in scans[mapping:]]
    steady = rayvox.OccupancyMap(resolution_m)
    for _ in range(7):
        for scan in repeated.scans:
            insert(steady, scan, "auto")
    again = [insert(steady, scan)[0] for _ in range(3) for scan in repeated.scans]
    return {
        "first ms": median(first),
        "mapped ms": median(ms for ms, _ in wandered),
        "mapped, voxels changed": float(median(changed for _, changed in wandered)),
        "repeated ms": median(again),
    }


def exponent(resolutions_m: Sequence[float], values: Sequence[float]) -> float:
    """Least-squares slope of log value over log (1 / resolution)."""
    slope: float = np.polyfit(-np.log(resolutions_m), np.log(values), 1)[0]
    return float(slope)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Insertion time against resolution, per engine.")
    parser.add_argument("--mapping", type=int, default=240, help="scans that map the area")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    header, results, rows = provenance(), [], []
    scans = wandering_views(arguments.mapping + 24)
    for engine in ENGINES:
        times = [time_engine(scans, depth_views(r), r, engine, arguments.mapping) for r in RESOLUTIONS_M]
        for kind in times[0]:
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
