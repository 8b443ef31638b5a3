"""What the service adds to the kernel: 100,000-point scans through the client, waiting until applied.

    python -m benchmarks.service_overhead [--repeats 20] [--write NAME]

The service runs in a process of its own on 127.0.0.1, journal and fdatasync included; the points go raw, float32. The
kernel alone inserts the same scans in this process. Calls take turns. Given for a scan into an empty map and for one
into a map that has seen it often.
"""

from __future__ import annotations

import argparse
import tempfile
import time
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


def through_service(client: Client, name: str, scan: RayScan, max_range_m: float) -> tuple[float, float]:
    """Seconds of the whole call, and of the kernel within the service."""
    start = time.perf_counter()
    receipt = client.insert_scan(
        name, scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=max_range_m, wait="applied"
    )
    taken = time.perf_counter() - start
    assert receipt.statistics is not None
    return taken, float(str(receipt.statistics["total_s"]))


def kernel_alone(occupancy_map: rayvox.OccupancyMap, scan: RayScan, max_range_m: float) -> float:
    """Seconds of the kernel's call."""
    start = time.perf_counter()
    occupancy_map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=max_range_m)
    return time.perf_counter() - start


def measure(client: Client, workload: Workload, repeats: int) -> dict[str, Any]:
    """Medians in milliseconds, first scan and steady state."""
    scans = scans_of(workload)
    samples: dict[str, list[tuple[float, float, float]]] = {"first": [], "steady": []}
    for repeat in range(repeats):
        scan, name = scans[repeat % len(scans)], f"empty-{repeat}"
        client.create_map(name, workload.resolution_m)
        alone = kernel_alone(rayvox.OccupancyMap(workload.resolution_m), scan, workload.max_range_m)
        samples["first"].append((alone, *through_service(client, name, scan, workload.max_range_m)))
        client.delete_map(name)
    client.create_map("steady", workload.resolution_m)
    ours, warm_up = rayvox.OccupancyMap(workload.resolution_m), 8
    for repeat in range(warm_up + repeats):
        scan = scans[0]
        alone = kernel_alone(ours, scan, workload.max_range_m)
        both = through_service(client, "steady", scan, workload.max_range_m)
        if repeat >= warm_up:
            samples["steady"].append((alone, *both))
    client.delete_map("steady")
    medians = {
        kind: dict(zip(("kernel_ms", "service_ms", "kernel_in_service_ms"), _medians_ms(found), strict=True))
        for kind, found in samples.items()
    }
    return {"workload": workload.name, "points": POINTS, "bytes": scans[0].ends.nbytes, **medians}


def _medians_ms(rows: list[tuple[float, float, float]]) -> list[float]:
    return [1e3 * median(column) for column in zip(*rows, strict=True)]


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
        results = [measure(client, workload, arguments.repeats) for workload in workloads]
    print(header)
    rows = []
    for result in results:
        for kind in ("first", "steady"):
            found = result[kind]
            added = 100.0 * (found["service_ms"] / found["kernel_ms"] - 1.0)
            rows.append([result["workload"], kind, *found.values(), f"{added:+.0f} %"])
    print_table(["workload", "map", "kernel ms", "service ms", "kernel in service ms", "added"], rows)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
