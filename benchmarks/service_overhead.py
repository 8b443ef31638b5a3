"""What the service adds to the kernel: 100,000-point scans through the client, waiting until applied.

    python -m benchmarks.service_overhead [--repeats 20] [--write NAME]

The service runs in a process of its own on 127.0.0.1, journal and fdatasync included; the points go raw, float32. The
kernel alone inserts the same scans in this process. Calls take turns, and turns at being first. Given for a scan into
an empty map and for one into a map that has seen it often.

An empty map is made after the one before was deleted, on both sides: both build it in memory that was used before, as
far as the allocator gives that back. The page faults during each call show where it does not.

`outside` is what a call took outside the insertion itself: for the kernel its checks and the transform into the map,
for the service also the way there and back.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import rayvox
from rayvox_client import Client

from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import RayScan, Workload, depth_views, yard_sweeps
from tests.support.service_process import ServiceProcess

POINTS = 100_000
FIRST_WARM_UP, STEADY_WARM_UP = 4, 8


def scans_of(workload: Workload) -> list[RayScan]:
    """Scans of exactly 100,000 rays: those with more are thinned, those with fewer completed from their neighbours."""
    rng = np.random.default_rng(3)
    chosen = []
    for scan in workload.scans:
        order = rng.permutation(len(scan.ends))[:POINTS]
        ends = scan.ends[np.sort(order)]
        if len(ends) < POINTS:
            again = scan.ends[rng.integers(0, len(scan.ends) - 1, POINTS - len(ends))]
            nearby = scan.ends[rng.integers(0, len(scan.ends) - 1, POINTS - len(ends))]
            ends = np.concatenate([ends, again + np.float32(0.02) * (nearby - again)])
        chosen.append(RayScan(np.ascontiguousarray(ends, dtype=np.float32), scan.origin))
    return chosen


@dataclass(frozen=True)
class Call:
    """Seconds of one call and of the insertion within it, and the page faults of the process that inserts."""

    total_s: float
    insertion_s: float
    page_faults: int


def through_service(client: Client, service: ServiceProcess, name: str, scan: RayScan, max_range_m: float) -> Call:
    """One scan through the client."""
    faults, start = page_faults(service.process.pid), time.perf_counter()
    receipt = client.insert_scan(
        name, scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=max_range_m, wait="applied"
    )
    taken_s = time.perf_counter() - start
    assert receipt.statistics is not None
    insertion_s = float(str(receipt.statistics["total_s"]))
    return Call(taken_s, insertion_s, page_faults(service.process.pid) - faults)


def kernel_alone(occupancy_map: rayvox.OccupancyMap, scan: RayScan, max_range_m: float) -> Call:
    """One scan by the kernel's own call."""
    faults, start = page_faults(os.getpid()), time.perf_counter()
    result = occupancy_map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=max_range_m)
    taken_s = time.perf_counter() - start
    return Call(taken_s, result.statistics.total_s, page_faults(os.getpid()) - faults)


def page_faults(pid: int) -> int:
    """Minor page faults of a process so far, all its threads together."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[7])


def in_turns(repeat: int, alone: Callable[[], Call], served: Callable[[], Call]) -> tuple[Call, Call]:
    """Both calls, now the one first and now the other."""
    if repeat % 2:
        return alone(), served()
    second = served()
    return alone(), second


def measure(client: Client, service: ServiceProcess, workload: Workload, repeats: int) -> dict[str, Any]:
    """Medians in milliseconds, first scan and steady state."""
    scans, range_m = scans_of(workload), workload.max_range_m
    first: list[tuple[Call, Call]] = []
    for repeat in range(FIRST_WARM_UP + repeats):
        scan, name = scans[repeat % len(scans)], f"empty-{repeat}"
        client.create_map(name, workload.resolution_m)
        alone = partial(kernel_alone, rayvox.OccupancyMap(workload.resolution_m), scan, range_m)
        first.append(in_turns(repeat, alone, partial(through_service, client, service, name, scan, range_m)))
        del alone  # and its map
        client.delete_map(name)
    client.create_map("steady", workload.resolution_m)
    alone = partial(kernel_alone, rayvox.OccupancyMap(workload.resolution_m), scans[0], range_m)
    served = partial(through_service, client, service, "steady", scans[0], range_m)
    steady = [in_turns(repeat, alone, served) for repeat in range(STEADY_WARM_UP + repeats)]
    client.delete_map("steady")
    return {
        "workload": workload.name,
        "points": POINTS,
        "bytes": scans[0].ends.nbytes,
        "first": medians(first[FIRST_WARM_UP:]),
        "steady": medians(steady[STEADY_WARM_UP:]),
    }


def medians(pairs: list[tuple[Call, Call]]) -> dict[str, float]:
    """Of the kernel alone and of the service, and the share by which the service's call is longer."""
    found: dict[str, float] = {}
    for side, calls in zip(("kernel", "service"), zip(*pairs, strict=True), strict=True):
        found[f"{side}_ms"] = 1e3 * median(call.total_s for call in calls)
        found[f"{side}_outside_ms"] = 1e3 * median(call.total_s - call.insertion_s for call in calls)
        found[f"{side}_page_faults"] = median(call.page_faults for call in calls)
    found["added_percent"] = 100.0 * (found["service_ms"] / found["kernel_ms"] - 1.0)
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="What the service adds to the kernel's time.")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    header = provenance()
    with tempfile.TemporaryDirectory() as folder, ServiceProcess(Path(folder)) as service:
        client = Client(service.await_ready().url)
        workloads = [depth_views(0.05), depth_views(0.025), yard_sweeps(0.2, columns=2048)]
        results = [measure(client, service, workload, arguments.repeats) for workload in workloads]
    print(header)
    rows = [[result["workload"], kind, *result[kind].values()] for result in results for kind in ("first", "steady")]
    sides = [f"{side} {what}" for side in ("kernel", "service") for what in ("ms", "outside ms", "page faults")]
    print_table(["workload", "map", *sides, "added %"], rows)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
