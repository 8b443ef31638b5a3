"""What is measured: the simulated building's depth views and lidar sweeps, and sweeps of a yard with long rays."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rayvox import simulation


@dataclass(frozen=True)
class RayScan:
    """Ends of all rays (n,3) float32 and the beam origin (3,) float32, map frame, metres."""

    ends: NDArray[np.float32]
    origin: NDArray[np.float32]


@dataclass(frozen=True)
class Workload:
    """Scans in the order to insert them. Rays beyond `max_range_m` are cut: so OctoMap clears what met nothing, too."""

    name: str
    resolution_m: float
    max_range_m: float
    scans: tuple[RayScan, ...]

    @property
    def ray_count(self) -> int:
        """Median rays per scan."""
        return int(np.median([len(scan.ends) for scan in self.scans]))

    def write(self, path: Path) -> None:
        """The scan file that the C++ drivers read."""
        with path.open("wb") as out:
            out.write(b"RVSC" + struct.pack("<I", len(self.scans)))
            for scan in self.scans:
                out.write(struct.pack("<I3f", len(scan.ends), *scan.origin.tolist()))
                out.write(np.ascontiguousarray(scan.ends, dtype="<f4").tobytes())


def _in_map(scans: Iterable[simulation.Scan]) -> tuple[RayScan, ...]:
    moved = []
    for scan in scans:
        rotation, translation = scan.T_map_sensor[:3, :3], scan.T_map_sensor[:3, 3]
        ends = np.concatenate([scan.points, scan.no_return]).astype(np.float64) @ rotation.T + translation
        moved.append(RayScan(ends.astype(np.float32), translation.astype(np.float32)))
    return tuple(moved)


def _just_below(range_m: float) -> float:
    """Rays without return are as long as the sensor's reach, give or take their rounding: all must be cut."""
    return range_m * 0.999


def depth_views(resolution_m: float) -> Workload:
    """Six views of 320 x 240 rays in the building."""
    captures = [capture.scan for capture in simulation.benchmark_views().values()]
    name = f"depth views, {100 * resolution_m:g} cm"
    return Workload(name, resolution_m, _just_below(captures[0].max_range_m), _in_map(captures))


def wandering_views(count: int) -> tuple[RayScan, ...]:
    """Views of a camera that wanders about the six places: no two scans have the same rays."""
    return _in_map(capture.scan for capture in simulation.wandering_views(count))


def lidar_sweeps(resolution_m: float) -> Workload:
    """Three sweeps of 64 x 1024 rays in the building."""
    sweeps = list(simulation.benchmark_sweeps().values())
    name = f"indoor lidar, {100 * resolution_m:g} cm"
    return Workload(name, resolution_m, _just_below(sweeps[0].max_range_m), _in_map(sweeps))


def make_yard() -> simulation.Scene:
    """A paved yard, 120 m across, between halls, with containers and lamp posts: long rays, as outdoors."""
    rng = np.random.default_rng(79)
    shapes: list[simulation.Shape] = [simulation.Box.between((-150, -150, -0.5), (150, 150, 0.0))]
    for side in (-1, 1):
        for start in (-58.0, -18.0, 22.0):
            near, far = sorted((side * 45.0, side * 62.0))
            shapes.append(simulation.Box.between((start, near, 0.0), (start + 33.0, far, rng.uniform(7.0, 12.0))))
    for _ in range(26):
        x, y = rng.uniform(-50, 50), rng.uniform(-40, 40)
        if np.hypot(x, y) < 8.0:
            continue
        yaw = rng.uniform(0, np.pi)
        shapes.append(simulation.Box.turned((x, y, 1.3), (6.0, 2.4, 2.6), float(yaw)))
    for x in range(-45, 60, 15):
        shapes.append(simulation.Cylinder.upright(float(x), 12.3, 0.0, 8.0, 0.12))
    return simulation.Scene(shapes)


def yard_sweeps(resolution_m: float, columns: int = 1024) -> Workload:
    """Four sweeps of 64 x `columns` rays along a drive through the yard, range 100 m."""
    lidar = simulation.SpinningLidar(columns=columns, max_range_m=100.0)
    scene, sweeps = make_yard(), []
    for index in range(4):
        pose = simulation.rigid_transform(np.eye(3), np.array([1.5 * index - 2.03, 0.4 * index + 0.07, 1.83]))
        sweeps.append(lidar.sweep(scene, pose, np.random.default_rng([79, index])))
    name = f"outdoor lidar, {100 * resolution_m:g} cm"
    return Workload(name, resolution_m, _just_below(100.0), _in_map(sweeps))


def standard_workloads() -> list[Workload]:
    """Those that the speed targets are stated for."""
    return [depth_views(0.05), depth_views(0.025), lidar_sweeps(0.2), yard_sweeps(0.2)]
