"""First-hit rays through the building's map at 5 cm: rayvox's engines and OctoMap's castRay, one thread's CPU time.

    python -m benchmarks.ray_queries [--resolution-m 0.05] [--rays 1000000] [--octomap-rays 50000]
                                     [--repeats 5] [--write NAME]

A first call makes the masks or the scene that the next ones find.

The map is made of 120 depth views and three lidar sweeps. Random rays start anywhere in free space in any direction;
camera rays are those of depth images at such places; both pass unknown space, or stop there. OctoMap casts the first of
the same rays through the same octree. Answers are compared; a ray whose hit differs passes a voxel's edge or corner, or
ends at its range (tests/property/test_cast_rays.py explains each).
"""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray
from rayvox import simulation

from benchmarks.peers.octomap_cpp import DriverUnavailableError, cast_rays
from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import depth_views, lidar_sweeps, wandering_views

RANGE_M = 30.0
CAMERA = rayvox.PinholeCamera(width=320, height=240, fx=250.0, fy=250.0, cx=159.5, cy=119.5)
Rays = tuple[NDArray[np.float32], NDArray[np.float32]]  # origins and directions (n, 3)


def building_map(resolution_m: float) -> rayvox.OccupancyMap:
    """The building as a robot's sensors leave it."""
    occupancy_map = rayvox.OccupancyMap(resolution_m)
    for scan in (*depth_views(resolution_m).scans, *wandering_views(114), *lidar_sweeps(resolution_m).scans):
        occupancy_map.insert_scan(scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=9.99)
    return occupancy_map


def free_places(occupancy_map: rayvox.OccupancyMap, rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    """Points (count, 3) in free space."""
    found: list[NDArray[np.float32]] = []
    while sum(map(len, found)) < count:
        points = rng.uniform((-9.5, -5.5, 0.1), (9.5, 5.5, 2.5), (count, 3)).astype(np.float32)
        found.append(points[occupancy_map.states_at(points) == 1])
    return np.concatenate(found)[:count]


def random_rays(occupancy_map: rayvox.OccupancyMap, count: int) -> Rays:
    """From anywhere to anywhere."""
    rng = np.random.default_rng(17)
    return free_places(occupancy_map, rng, count), rng.normal(size=(count, 3)).astype(np.float32)


def camera_rays(occupancy_map: rayvox.OccupancyMap, count: int) -> Rays:
    """Row by row, image by image."""
    rng = np.random.default_rng(18)
    images = -(-count // (CAMERA.width * CAMERA.height))
    origins, directions = [], []
    for place in free_places(occupancy_map, rng, images):
        target = place + rng.normal(size=3) * (1, 1, 0.1)
        pose = simulation.look_at(tuple(place.tolist()), tuple(target.tolist()))
        directions.append(CAMERA.rays() @ pose[:3, :3].T)
        origins.append(np.broadcast_to(place, directions[-1].shape))
    return np.concatenate(origins)[:count], np.concatenate(directions)[:count].astype(np.float32)


def seconds_of(snapshot: rayvox.MapSnapshot, rays: Rays, engine: Any, unknown: Any) -> tuple[float, rayvox.RayHits]:
    """Of one call."""
    start = time.process_time()
    hits = snapshot.cast_rays(*rays, max_range_m=RANGE_M, unknown=unknown, engine=engine)
    return time.process_time() - start, hits


def measure(occupancy_map: rayvox.OccupancyMap, name: str, rays: Rays, octomap_rays: int, repeats: int) -> list[Any]:
    """A row per contender; raises if rayvox's engines differ."""
    rows: list[Any] = []
    answers: dict[str, rayvox.RayHits] = {}
    for unknown in ("free", "occupied"):
        for engine in ("octree", "masks", *(["embree"] if unknown == "free" else [])):
            seconds: dict[str, list[float]] = {"": [], ", first call": []}
            for _ in range(repeats):
                snapshot = occupancy_map.snapshot()
                for kind in (", first call", ""):
                    taken_s, hits = seconds_of(snapshot, rays, engine, unknown)
                    seconds[kind].append(taken_s)
            expected = answers.setdefault(unknown, hits)
            if (hits.hit != expected.hit).any() or (hits.voxel != expected.voxel).any():
                raise RuntimeError("the engines' answers differ")
            for kind, taken in seconds.items():
                label = f"{engine}{', unknown stops' if unknown == 'occupied' else ''}{kind}"
                rows.append([name, label, 1e-6 * len(rays[0]) / median(taken), 1e9 * median(taken) / len(rays[0])])
    ours = answers["free"]
    first = (rays[0][:octomap_rays], rays[1][:octomap_rays])
    octomap_s, hit, centres = cast_rays(occupancy_map, *first, RANGE_M)
    rows.append([name, "OctoMap castRay", 1e-6 * len(first[0]) / octomap_s, 1e9 * octomap_s / len(first[0])])
    voxel = np.floor(centres.astype(np.float64) / occupancy_map.resolution_m).astype(np.int64)
    mine = ours.hit[: len(hit)] == 1
    differ = (mine != hit) | (mine & hit & (voxel != ours.voxel[: len(hit)]).any(axis=1))
    print(f"{name} rays: {differ.sum()} of {len(hit)} hits differ from OctoMap's")
    return rows


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution-m", type=float, default=0.05)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--octomap-rays", type=int, default=50_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header = provenance()
    occupancy_map = building_map(arguments.resolution_m)
    statistics = occupancy_map.statistics()
    print(header, f"{statistics.occupied_leaves} occupied leaves, {statistics.free_leaves} free ones", sep="\n")
    rows = []
    try:
        for name, make in (("random", random_rays), ("camera", camera_rays)):
            rays = make(occupancy_map, arguments.rays)
            rows += measure(occupancy_map, name, rays, arguments.octomap_rays, arguments.repeats)
    except DriverUnavailableError as error:
        raise SystemExit(str(error)) from error
    names = ["rays", "contender", "million rays a second and core", "ns a ray"]
    print_table(names, rows)
    if arguments.write:
        print("written:", write_results(arguments.write, header, [dict(zip(names, row, strict=True)) for row in rows]))


if __name__ == "__main__":
    main()
