"""All leaves as numpy arrays: rayvox against pyoctomap's iterator and against OctoMap's file stream read by numpy.

    python -m benchmarks.leaves_readout [--map FILE.bt] [--write NAME]

Without --map, the map of the building's depth views at 5 cm.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import rayvox

from benchmarks.report import median_seconds, print_table, provenance, write_results
from benchmarks.workloads import depth_views
from tests.support.octomap_peer import OctomapPeer


def building_map() -> rayvox.OccupancyMap:
    """The six views at 5 cm."""
    workload = depth_views(0.05)
    occupancy_map = rayvox.OccupancyMap(workload.resolution_m)
    for scan in workload.scans:
        occupancy_map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=workload.max_range_m)
    return occupancy_map


def read_by_iterator(peer: OctomapPeer) -> int:
    """What a user of pyoctomap writes: centre, size and log-odds of every leaf."""
    centres, sizes, values = [], [], []
    for leaf in peer.tree.begin_leafs():
        centres.append(leaf.getCoordinate())
        sizes.append(leaf.getSize())
        values.append(leaf.current_node.getLogOdds())
    return len(np.array(centres)) + len(np.array(sizes)) + len(np.array(values))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Reading all leaves: rayvox against pyoctomap.")
    parser.add_argument("--map", type=Path, help="a .bt or .ot file")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    header = provenance()
    ours = rayvox.OccupancyMap.load(arguments.map) if arguments.map else building_map()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.ot"
        ours.save(path)
        peer = OctomapPeer.read(path)
    results = {
        "leaves": len(ours.leaves()[1]),
        "rayvox_s": median_seconds(ours.leaves, 9),
        "octomap_file_stream_s": median_seconds(peer.leaves, 1),
        "pyoctomap_iterator_s": median_seconds(lambda: read_by_iterator(peer), 1),
    }
    print(header)
    rows = [
        [name, results[key] * 1e3, results[key] / results["rayvox_s"]]
        for name, key in (
            ("rayvox leaves()", "rayvox_s"),
            ("OctoMap .ot stream, numpy", "octomap_file_stream_s"),
            ("pyoctomap iterator", "pyoctomap_iterator_s"),
        )
    ]
    print(f"{results['leaves']} leaves")
    print_table(["way", "ms", "times rayvox"], rows)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
