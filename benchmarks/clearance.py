"""Clearance of robots from a map: rigid poses near walls, one thread, beside Coal's octree distance, and brute force.

    python -m benchmarks.clearance [--write NAME]

Needs the sample data (tests/support/datasets.py) and `pip install coal`. A robot at its zero configuration is one rigid
mesh for both. Coal: BVHModelOBBRSS against its OcTree, each pose once. rayvox: the same poses, best of five. An
over-estimate is a distance that exceeds that of some triangle and voxel (tests/support/clearance_oracle.py, alternating
projections) by more than a micrometre for Coal, and for rayvox by more than rounding takes from the oracle's own
coordinates in the map.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import numpy.typing as npt
import rayvox
from rayvox.robot import Robot

from benchmarks.report import print_table, provenance, write_results
from benchmarks.robot_queries import occupied_centres, poses_near, rigid
from tests.support.clearance_oracle import least_distance_bounds, occupied_cubes
from tests.support.datasets import data_folder
from tests.support.robots import REAL_ROBOTS

FloatArray = npt.NDArray[np.float64]
MAPS = ("fr_079", "geb079")
POSES = 12
# float64 tells coordinates of some ten metres apart by 2e-15; a distance of the oracle's is off by a few of these.
ORACLE_ROUNDING_M = 1e-13


def coal_distances(coal: Any, tree: Any, mesh: rayvox.TriangleMesh, T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) metres and (n,) seconds."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.triangles), len(mesh.vertices))
    for corners in mesh.vertices[mesh.triangles]:
        model.addTriangle(*corners)
    model.endModel()
    distances, seconds = np.zeros(len(T)), np.zeros(len(T))
    for i, t in enumerate(T):
        placed, result = coal.Transform3s(t[:3, :3].copy(), t[:3, 3].copy()), coal.DistanceResult()
        started = time.perf_counter()
        distances[i] = coal.distance(model, placed, tree, coal.Transform3s(), coal.DistanceRequest(), result)
        seconds[i] = time.perf_counter() - started
    return distances, seconds


def measure(robot: Robot, map_snapshot: rayvox.MapSnapshot, centres: FloatArray, coal: Any, tree: Any) -> list[Any]:
    """Robot, triangles, median clearance, microseconds a pose of both, their ratio, over-estimates of both."""
    body = rigid(robot)
    checker = rayvox.CollisionChecker(map_snapshot, body)
    T = poses_near(centres, np.random.default_rng(0))
    T = T[checker.check(T_map_base=T).verdicts == 0][:POSES]
    theirs_m, theirs_s = coal_distances(coal, tree, body.links[0].mesh, T)
    times = []
    for _ in range(5):
        started = time.perf_counter()
        ours_m = checker.clearance(T_map_base=T).clearance_m
        times.append((time.perf_counter() - started) / len(T))
    cubes = occupied_cubes(map_snapshot)
    truth_m = np.array(
        [
            least_distance_bounds(body, T_map_links, *cubes, within_m=float(ours_m[i]) + 1e-6)[1]
            for i, T_map_links in enumerate(body.link_poses(None, T))
        ]
    )
    ours_s, coal_s = min(times), theirs_s.mean()
    return [
        robot.name, body.triangle_count, float(np.median(ours_m)), 1e6 * ours_s, 1e6 * coal_s, coal_s / ours_s,
        int((ours_m > truth_m + ORACLE_ROUNDING_M).sum()), int((theirs_m > truth_m + 1e-6).sum()),
        1e3 * float(np.maximum(theirs_m - truth_m, 0).max()),
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", metavar="NAME", help="also write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    import coal

    rayvox.set_thread_count(1)
    data = data_folder()
    if data is None:
        parser.error("the sample data is not here")
    rows = []
    for map_name in MAPS:
        map_snapshot = rayvox.OccupancyMap.load(str(data / "octomap_maps" / f"{map_name}.bt")).snapshot()
        centres = occupied_centres(map_snapshot)
        tree = coal.makeOctree(np.ascontiguousarray(centres), map_snapshot.resolution_m)
        for name in REAL_ROBOTS:
            folder = data / "robots" / name
            robot = Robot.from_urdf(min(folder.rglob("*.urdf")), root=folder)
            rows.append([map_name, *measure(robot, map_snapshot, centres, coal, tree)])
    columns = [
        "map",
        "robot",
        "triangles",
        "clearance m",
        "us",
        "Coal us",
        "ratio",
        "too much",
        "Coal too much",
        "by mm",
    ]
    print_table(columns, [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row] for row in rows])
    print(f"ratio, geometric mean: {np.exp(np.mean([np.log(row[6]) for row in rows])):.0f}")
    if arguments.write:
        write_results(arguments.write, provenance(), {"columns": columns, "rows": rows})


if __name__ == "__main__":
    main()
