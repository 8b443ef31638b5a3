"""Does engine="auto" take the right engine? Every engine and auto on every benchmark workload, and on small scans.

    python -m benchmarks.engine_choice [--only TEXT] [--passes 9] [--scans 8] [--write NAME]

First: scans into empty maps. Steady: the scans inserted again and again, the last third of the passes; in the room of
benchmarks.saturated_space, new scans of space that was seen from everywhere. All contenders get the same scans in
turns, a map each. Times are one thread's processor time, means over the scans of each scan's median; the aim is auto
within 15 % of the best single engine everywhere.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np
import pytest
import rayvox

from benchmarks.report import print_table, provenance, write_results
from benchmarks.saturated_space import saturated_room
from benchmarks.workloads import RayScan, Workload, depth_views, lidar_sweeps, standard_workloads
from tests.support import datasets

AIM = 1.15
SMALL_SCANS = (100, 300, 1000, 3000, 5000, 10_000, 20_000)
SINGLE_ENGINES = tuple(engine for engine in rayvox.ENGINES if engine != "auto")


@dataclass(frozen=True)
class Case:
    """A workload; `mapping` scans before those that are timed fill the map of the steady state, none repeat there."""

    workload: Workload
    mapping: int = 0


def thinned(workload: Workload, rays: int) -> Workload:
    """The same scans with so few of their rays, spread evenly."""
    scans = [replace(scan, ends=scan.ends[:: max(1, len(scan.ends) // rays)][:rays]) for scan in workload.scans]
    return replace(workload, name=f"{workload.name}, {rays} rays", scans=tuple(scans))


def silent(workload: Workload, reach_m: float) -> Workload:
    """The first scan's rays, every hundredth of them, none of which met anything."""
    scan = workload.scans[0]
    directions = (scan.ends - scan.origin)[::100]
    directions *= 2 * reach_m / np.linalg.norm(directions, axis=1, keepdims=True)
    scans = (RayScan(scan.origin + directions, scan.origin),)
    return replace(workload, name=f"{workload.name}, no return", max_range_m=reach_m, scans=scans)


def planar_scans(count: int) -> Workload | None:
    """A planar laser's scans of 180 and 360 beams (Radish), where the sample data is."""
    try:
        posed = [datasets.radish_2d(log, first, count) for log, first in (("intel", 0), ("fr079", 500))]
    except pytest.skip.Exception:
        return None
    moved = [scan.in_map() for scans in posed for scan in scans]
    scans = [RayScan(np.concatenate([points, silent_ends]), origin) for points, silent_ends, origin in moved]
    return Workload("planar laser, 5 cm", 0.05, 40.0, tuple(scans))


def room(resolution_m: float, timed: int) -> Case:
    """Until only the walls change, and then the scans that are timed."""
    before, scans = saturated_room(resolution_m, timed)
    workload = Workload(f"saturated room, {100 * resolution_m:g} cm", resolution_m, 100.0, (*before, *scans))
    return Case(workload, len(before))


def cases(scans: int) -> Iterator[Case]:
    """All of them; the small scans are of the views and sweeps."""
    for workload in (*standard_workloads(), depth_views(0.0125)):
        yield Case(workload)
    for rays in SMALL_SCANS:
        yield Case(thinned(depth_views(0.05), rays))
        yield Case(thinned(lidar_sweeps(0.2), rays))
        yield Case(thinned(depth_views(0.025), rays))
    yield Case(silent(lidar_sweeps(0.2), 30.0))
    planar = planar_scans(scans)
    if planar is not None:
        yield Case(planar)
    for resolution_m in (0.1, 0.05, 0.025, 0.0125):
        yield room(resolution_m, scans)


class Contender:
    """One engine's maps and times."""

    def __init__(self, engine: rayvox.Engine, workload: Workload) -> None:
        self.engine, self.workload = engine, workload
        self.map = rayvox.OccupancyMap(workload.resolution_m)
        self.taken: Counter[str] = Counter()

    def insert(self, scan: RayScan, into: rayvox.OccupancyMap | None = None) -> float:
        """Milliseconds of an insertion into its map, or another."""
        origin, target = tuple(scan.origin.tolist()), into or self.map
        start = time.process_time()
        done = target.insert_scan(scan.ends, origin=origin, max_range_m=self.workload.max_range_m, engine=self.engine)
        self.taken[done.statistics.engine] += 1
        return 1e3 * (time.process_time() - start)


def time_in_turns(
    contenders: Sequence[Contender], scan: RayScan, *, fresh: bool, repeats: int = 1, begin: int = 0
) -> list[float]:
    """Each contender's median milliseconds; whoever begins moves on, for the first one finds the caches cold."""
    times: list[list[float]] = [[] for _ in contenders]
    for repeat in range(repeats):
        for index in np.roll(np.arange(len(contenders)), begin + repeat):
            into = rayvox.OccupancyMap(contenders[index].workload.resolution_m) if fresh else None
            times[index].append(contenders[index].insert(scan, into))
    return [median(t) for t in times]


def measure(case: Case, passes: int) -> list[dict[str, Any]]:
    """A row for the first scan and one for the steady state."""
    contenders = [Contender(engine, case.workload) for engine in rayvox.ENGINES]
    timed = case.workload.scans[case.mapping :]
    first = [time_in_turns(contenders, scan, fresh=True, repeats=5) for scan in timed]
    taken_first = contenders[0].taken.copy()
    if case.mapping:
        for scan in case.workload.scans[: case.mapping]:
            for contender in contenders:
                contender.map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), engine="beam")
        steady = [[time_in_turns(contenders, scan, fresh=False, begin=i)] for i, scan in enumerate(timed)]
    else:
        steady = [[] for _ in timed]
        for one_pass in range(passes):
            for index, scan in enumerate(timed):
                times = time_in_turns(contenders, scan, fresh=False, begin=one_pass + index)
                if one_pass >= 2 * passes // 3:
                    steady[index].append(times)
    if len({contender.map.to_bytes() for contender in contenders}) != 1:
        raise RuntimeError("the engines' maps differ")
    taken_steady = contenders[0].taken - taken_first
    return [
        summarise(case, "first", np.array(first).sum(axis=0), taken_first),
        summarise(case, "steady", np.median(np.array(steady), axis=1).sum(axis=0), taken_steady),
    ]


def summarise(case: Case, kind: str, totals: Any, taken: Counter[str]) -> dict[str, Any]:
    """One row of the table."""
    scans = len(case.workload.scans) - case.mapping
    times = dict(zip(rayvox.ENGINES, (totals / scans).tolist(), strict=True))
    best = min(SINGLE_ENGINES, key=lambda engine: times[engine])
    return {
        "workload": case.workload.name,
        "kind": kind,
        **{f"{engine} ms": ms for engine, ms in times.items()},
        "best": best,
        "auto took": "/".join(name for name, _ in taken.most_common()),
        "auto / best": times["auto"] / times[best],
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="workloads whose name contains this")
    parser.add_argument("--passes", type=int, default=9)
    parser.add_argument("--scans", type=int, default=8, help="of the saturated room and of each planar log")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header = provenance()
    chosen = [case for case in cases(arguments.scans) if arguments.only in case.workload.name]
    rows = [row for case in chosen for row in measure(case, arguments.passes)]
    print(header)
    print_table(list(rows[0]), [list(row.values()) for row in rows])
    over = [f"{row['workload']}, {row['kind']}" for row in rows if row["auto / best"] > AIM]
    print(f"beyond {AIM:g} times the best engine's time: {len(over)} of {len(rows)} {over or ''}")
    if arguments.write:
        print("written:", write_results(arguments.write, header, rows))


if __name__ == "__main__":
    main()
