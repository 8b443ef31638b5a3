"""Real scan sequences and published maps that lie beside the repository; everything is absent on most machines.

The folder is `../shared/data` seen from the repository root, or where RAYVOX_DATA points. Every loader skips the
calling test, with the reason, where its folder is missing.
"""

from __future__ import annotations

import bz2
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.point_files import read_ascii_vtk, read_pcd, read_ply

RADISH_NO_RETURN_M = 80.0


@dataclass(frozen=True)
class PosedScan:
    """One scan. Points (n,3) float32 in the sensor frame, metres; `no_return` (k,3): direction times range."""

    points: NDArray[np.float32]
    T_map_sensor: NDArray[np.float64]
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    no_return: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.float32))

    def in_map(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """Points, ends without return and origin in the map frame, rounded to float32: what OctoMap is fed."""
        rotation, translation = self.T_map_sensor[:3, :3], self.T_map_sensor[:3, 3]

        def moved(points: NDArray[np.float32]) -> NDArray[np.float32]:
            return (points.astype(np.float64) @ rotation.T + translation).astype(np.float32)

        return moved(self.points), moved(self.no_return), moved(np.array([self.origin], dtype=np.float32))[0]


@dataclass(frozen=True)
class PublishedMap:
    """A published octree and what its authors' files and independent readers say is in it."""

    path: str
    resolution_m: float
    nodes: int
    occupied_leaves: int
    free_leaves: int
    occupied_volume_m3: float | None
    free_volume_m3: float


PUBLISHED_MAPS = (
    PublishedMap("octomap_maps/fr_079.bt", 0.05, 1_829_134, 372_904, 1_103_266, 50.1716, 600.9591),
    PublishedMap("octomap_maps/geb079.bt", 0.08, 532_566, 143_729, 284_415, 95.0646, 486.7886),
    PublishedMap("fcl_coal/env.octree", 10.0, 1_839_553, 1_385_421, 0, None, 0.0),
)


def data_folder() -> Path | None:
    """The data folder, or None where there is none."""
    beside = Path(__file__).resolve().parents[2].parent / "shared" / "data"
    folder = Path(os.environ.get("RAYVOX_DATA", beside))
    return folder if folder.is_dir() else None


def data_path(name: str) -> Path:
    """A file or folder of the sample data; skips the calling test where it is absent."""
    folder = data_folder()
    if folder is None or not (folder / name).exists():
        pytest.skip(f"sample data {name} is not on this machine (RAYVOX_DATA names its folder)")
    return folder / name


def rigid(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rigid transform nearest to a published one, whose rotation is rounded to a few digits."""
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    pose = np.eye(4)
    pose[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    pose[:3, 3] = matrix[:3, 3]
    return pose


def valid(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Without invalid returns: NaN, infinity and points at exactly (0,0,0)."""
    return np.ascontiguousarray(points[np.isfinite(points).all(axis=1) & (points != 0).any(axis=1)])


def sensorscalib_static() -> list[PosedScan]:
    """Five sweeps of a 64-ring roof lidar, outdoors, the vehicle at rest."""
    folder = data_path("sensorscalib_static")
    poses = {}
    for line in (folder / "NovAtel-pose-lidar-time.txt").read_text().splitlines():
        name, *numbers = line.split()
        poses[name] = rigid(np.array(numbers, dtype=np.float64).reshape(3, 4))
    scans = sorted((folder / "top_center_lidar").glob("*.pcd"))
    return [PosedScan(valid(read_pcd(scan)), poses[scan.stem]) for scan in scans]


def pointmatcher_car() -> list[PosedScan]:
    """Two posed lidar clouds from a car."""
    folder = data_path("pointmatcher_car")
    second = rigid(np.loadtxt(folder / "icp_data/defaultIdentityDataPointsFilter.ref_trans"))
    names = ("cloud.00000.vtk", "cloud.00001.vtk")
    return [PosedScan(valid(read_ascii_vtk(folder / n)), T) for n, T in zip(names, (np.eye(4), second), strict=True)]


def smallgicp_pair() -> list[PosedScan]:
    """Two spinning-lidar scans, the second posed in the first."""
    folder = data_path("smallgicp_pair")
    source = rigid(np.loadtxt(folder / "T_target_source.txt"))
    names = ("target.ply", "source.ply")
    return [PosedScan(valid(read_ply(folder / n)), T) for n, T in zip(names, (np.eye(4), source), strict=True)]


def octomap_scan() -> list[PosedScan]:
    """OctoMap's sample: one real 3D scan, the sensor at the origin."""
    text = bz2.decompress(data_path("octomap_samples/scan.dat.bz2").read_bytes()).decode()
    points = np.array(text.split(), dtype=np.float32).reshape(-1, 3)
    return [PosedScan(valid(points), np.eye(4))]


def octomap_spherical() -> list[PosedScan]:
    """OctoMap's synthetic ScanGraph of one node: a patch of a sphere around the sensor, which is at (1, 0, -0.5)."""
    raw = data_path("octomap_samples/spherical_scan.graph").read_bytes()
    count = int(np.frombuffer(raw, dtype="<u4", count=1, offset=4)[0])
    record = np.dtype([("size", "<u4"), ("xyz", "<f8", (3,))])
    points = np.frombuffer(raw, dtype=record, count=count, offset=8)["xyz"].astype(np.float32)
    pose = np.eye(4)
    # After the points a pose: (dimension, 3 doubles), the rotation is none.
    pose[:3, 3] = np.frombuffer(raw, dtype="<f8", count=3, offset=8 + count * record.itemsize + 4)
    return [PosedScan(valid(points), pose)]


def radish_2d(log: str = "intel", first: int = 0, count: int = 300, every: int = 1) -> list[PosedScan]:
    """Planar laser scans of a CARMEN log ("intel" or "fr079"): indices first, first + every, ...

    Ranges of 80 m and more are rays without return. Poses are raw odometry: consistent over a few hundred scans.
    """
    lines = bz2.decompress(data_path(f"radish_2d/{log}.clf.bz2").read_bytes()).decode().splitlines()
    lasers = [line for line in lines if line.startswith("FLASER")][first::every][:count]
    scans = []
    for line in lasers:
        words = line.split()
        beams = int(words[1])
        ranges = np.array(words[2 : 2 + beams], dtype=np.float64)
        x, y, theta = (float(word) for word in words[2 + beams : 5 + beams])
        # 360 beams over half a circle lie in the middle of their half degrees, 180 on every degree from -90.
        angles = np.deg2rad(-90.0 + 180.0 * np.arange(beams) / beams)
        ends = (ranges[:, None] * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)).astype(np.float32)
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
        pose[:2, 3] = x, y
        silent = ranges >= RADISH_NO_RETURN_M
        scans.append(PosedScan(valid(ends[~silent]), pose, no_return=ends[silent]))
    return scans


def redwood_depth() -> list[tuple[NDArray[np.uint16], NDArray[np.float64]]]:
    """Five depth images (480,640) uint16, millimetres, with their camera poses."""
    from PIL import Image

    folder = data_path("open3d_redwood_rgbd")
    rows = [line.split() for line in (folder / "trajectory.log").read_text().splitlines()]
    poses = [np.array(rows[i + 1 : i + 5], dtype=np.float64) for i in range(0, len(rows), 5)]
    images = [np.asarray(Image.open(path), dtype=np.uint16) for path in sorted((folder / "depth").glob("*.png"))]
    return [(image, rigid(pose)) for image, pose in zip(images, poses, strict=True)]


def redwood_rgbd(every: int = 1) -> list[PosedScan]:
    """The depth images as points; `every` keeps one pixel of every x every."""
    scans = []
    for depth, pose in redwood_depth():
        rows, columns = np.mgrid[0 : depth.shape[0] : every, 0 : depth.shape[1] : every]
        z = depth[rows, columns].astype(np.float64) / 1000.0
        points = np.stack([(columns - 319.5) / 525.0 * z, (rows - 239.5) / 525.0 * z, z], axis=-1).reshape(-1, 3)
        scans.append(PosedScan(valid(points[points[:, 2] > 0].astype(np.float32)), pose))
    return scans
