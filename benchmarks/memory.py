"""Memory of a map against OctoMap's for the same leaves, each in a process of its own.

    python -m benchmarks.memory [--only TEXT] [--write NAME]

"map" is what each library says its tree takes, "resident" how far the process grew while the scans were inserted,
"peak" how far it had grown at most, scratch memory of the insertion included. All scans of a workload go into one
map, once.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.peers.octomap_cpp import DriverUnavailableError, run_driver
from benchmarks.report import REPOSITORY, print_table, provenance, write_results
from benchmarks.workloads import Workload, standard_workloads


def _status_bytes(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return int(line.split()[1]) * 1024
    raise RuntimeError(f"/proc/self/status has no {field}")


def measure_in_this_process(workload: Workload) -> dict[str, int]:
    """rayvox's figures; run in a fresh process, since a peak never falls."""
    import rayvox

    # The high-water mark of making the scans would hide the insertion's own.
    Path("/proc/self/clear_refs").write_text("5")
    before = _status_bytes("VmRSS:")
    occupancy_map = rayvox.OccupancyMap(workload.resolution_m)
    for scan in workload.scans:
        occupancy_map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=workload.max_range_m)
    resident, peak = _status_bytes("VmRSS:"), _status_bytes("VmHWM:")
    statistics = occupancy_map.snapshot().statistics()
    return {
        "leaves": statistics.occupied_leaves + statistics.free_leaves,
        "map_bytes": occupancy_map.snapshot().nbytes,
        "resident_growth_bytes": resident - before,
        "peak_growth_bytes": peak - before,
    }


def measure_rayvox(name: str) -> dict[str, int]:
    """One workload in a fresh process."""
    command = [sys.executable, "-m", "benchmarks.memory", "--in-this-process", name]
    done = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True)
    figures: dict[str, int] = json.loads(done.stdout)
    return figures


def measure_octomap(workload: Workload) -> dict[str, int]:
    """The same from OctoMap's C++ library."""
    found, _ = run_driver(workload, 1, openmp=False, mode="memory")
    return {
        "leaves": found["leaves"],
        "map_bytes": found["map_bytes"],
        "resident_growth_bytes": found["resident_bytes"] - found["resident_before_bytes"],
        "peak_growth_bytes": found["peak_resident_bytes"] - found["resident_before_bytes"],
    }


def print_results(results: list[dict[str, Any]]) -> None:
    """One row per workload and contender, MiB."""
    rows = []
    for result in results:
        for name in ("rayvox", "OctoMap"):
            found = result[name]
            sizes = [found[key] / 2**20 for key in ("map_bytes", "resident_growth_bytes", "peak_growth_bytes")]
            rows.append([result["workload"], name, found["leaves"], *sizes, found["map_bytes"] / found["leaves"]])
    print_table(["workload", "contender", "leaves", "map MiB", "resident MiB", "peak MiB", "bytes per leaf"], rows)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Memory of a map: rayvox against OctoMap.")
    parser.add_argument("--only", default="", help="workloads whose name contains this")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    parser.add_argument("--in-this-process", metavar="WORKLOAD", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.in_this_process:
        workload = next(w for w in standard_workloads() if w.name == arguments.in_this_process)
        print(json.dumps(measure_in_this_process(workload)))
        return
    header, results = provenance(), []
    try:
        for workload in standard_workloads():
            if arguments.only in workload.name:
                figures = {"rayvox": measure_rayvox(workload.name), "OctoMap": measure_octomap(workload)}
                results.append({"workload": workload.name, **figures})
    except DriverUnavailableError as error:
        raise SystemExit(str(error)) from error
    print(header)
    print_results(results)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
