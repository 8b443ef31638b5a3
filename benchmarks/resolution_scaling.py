"""Insertion time against resolution, per engine: does steady state cost what changes, or the volume crossed?

    python -m benchmarks.resolution_scaling [--mapping N] [--timed N] [--write NAME]

A depth camera wanders about the building at 10, 5, 2.5 and 1.25 cm; medians of one thread's processor time. First:
scans into empty maps. Mapped: new scans of an area that N scans before them have mapped. Repeated: six scans inserted
over and over, as no robot does, but as the insertion benchmark's steady state is: at 1.25 cm, which such a camera's
rays do not fill, unknown cells stay between them, and every scan has to find out that it misses them. Saturated: new
scans of benchmarks.saturated_space's room, where only the walls still change.
The exponent is the slope of log time over log (1 / resolution); crossing cells one by one costs 1.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
import rayvox
from rayvox.occupancy_map import ENGINES, Engine

from benchmarks.report import print_table, provenance, write_results
from benchmarks.saturated_space import saturated_room
from benchmarks.workloads import RayScan, depth_views, wandering_views

RESOLUTIONS_M = (0.1, 0.05, 0.025, 0.0125)
TIMED_IN_ROOM = 7


Times = dict[str, dict[Engine, float]]  # by kind and engine


@dataclass(frozen=True)
class Timer:
    """Inserts and measures, milliseconds and voxels changed."""

    resolution_m: float
    max_range_m: float

    def insert(self, occupancy_map: rayvox.OccupancyMap, scan: RayScan, engine: Engine) -> tuple[float, int]:
        origin = tuple(scan.origin.tolist())
        start = time.process_time()
        done = occupancy_map.insert_scan(scan.ends, origin=origin, max_range_m=self.max_range_m, engine=engine)
        return 1e3 * (time.process_time() - start), done.statistics.voxels_changed

    def mapped_by(self, scans: Iterable[RayScan]) -> bytes:
        """A map after these scans, for each engine to go on from."""
        occupancy_map = rayvox.OccupancyMap(self.resolution_m)
        for scan in scans:
            self.insert(occupancy_map, scan, "auto")
        return occupancy_map.to_bytes()

    def going_on(self, state: bytes, scans: Sequence[RayScan], engine: Engine, warm_up: int = 2) -> tuple[float, float]:
        """Medians over the scans after the first ones, which bring the engine's own structures up to date."""
        occupancy_map = rayvox.OccupancyMap.from_bytes(state, self.resolution_m)
        done = [self.insert(occupancy_map, scan, engine) for scan in scans][warm_up:]
        return median(ms for ms, _ in done), float(median(changed for _, changed in done))


def measure(wandering: Sequence[RayScan], resolution_m: float, mapping: int) -> Times:
    """Every kind and engine at one resolution."""
    repeated = depth_views(resolution_m)
    timer = Timer(resolution_m, repeated.max_range_m)
    states = {"mapped": timer.mapped_by(wandering[:mapping]), "repeated": timer.mapped_by(repeated.scans * 7)}
    timed = {"mapped": wandering[mapping:], "repeated": repeated.scans * 3}
    until_saturated, timed["saturated"] = saturated_room(resolution_m, TIMED_IN_ROOM)
    states["saturated"] = timer.mapped_by(until_saturated)
    times: Times = {}
    for engine in ENGINES:
        empty = [timer.insert(rayvox.OccupancyMap(resolution_m), scan, engine)[0] for scan in wandering[mapping:]]
        times.setdefault("first, ms", {})[engine] = median(empty)
        for kind, state in states.items():
            ms, changed = timer.going_on(state, timed[kind], engine)
            times.setdefault(f"{kind}, ms", {})[engine] = ms
            times.setdefault(f"{kind}, voxels changed", {})[engine] = changed
    return times


def exponent(resolutions_m: Sequence[float], values: Sequence[float]) -> float:
    """Least-squares slope of log value over log (1 / resolution)."""
    slope: float = np.polyfit(-np.log(resolutions_m), np.log(values), 1)[0]
    return float(slope)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Insertion time against resolution, per engine.")
    parser.add_argument("--mapping", type=int, default=240, help="scans that map the area")
    parser.add_argument("--timed", type=int, default=12, help="scans after them that are timed")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header, results = provenance(), []
    scans = wandering_views(arguments.mapping + arguments.timed)
    measured = [measure(scans, resolution_m, arguments.mapping) for resolution_m in RESOLUTIONS_M]
    for kind in measured[0]:
        for engine in ENGINES if kind.endswith("ms") else ENGINES[:1]:
            values = [times[kind][engine] for times in measured]
            what = engine if kind.endswith("ms") else "every engine"
            p = exponent(RESOLUTIONS_M, [max(value, 1.0) for value in values])
            results.append({"kind": kind, "engine": what, "values": values, "exponent": p})
    print(header)
    names = ["kind", "engine", *(f"{100 * r:g} cm" for r in RESOLUTIONS_M), "exponent"]
    print_table(names, [[r["kind"], r["engine"], *r["values"], r["exponent"]] for r in results])
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
