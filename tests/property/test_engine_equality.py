"""Every engine gives the same map, bit for bit, from the first scan to the steady state."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray
from rayvox import simulation

from tests.support.scenes import room_scan

OTHER_ENGINES = [engine for engine in rayvox.ENGINES if engine not in ("auto", "dda")]
Scan = tuple[NDArray[np.float64], tuple[float, float, float]]  # end points and origin, metres


def random_scans(seed: int, count: int = 6) -> list[Scan]:
    rng = np.random.default_rng(seed)
    scans = []
    for _ in range(count):
        origin = rng.uniform(-1, 1, 3)
        reach = rng.choice([0.3, 3.0, 12.0])
        scans.append((origin + rng.normal(size=(800, 3)) * reach, tuple(origin.tolist())))
    return scans


def depth_scans() -> list[Scan]:
    lens = simulation.DepthCamera(simulation.Intrinsics(80, 60, 50.0, 50.0, 39.5, 29.5))
    views = simulation.benchmark_views(lens).values()
    scans = []
    for view in views:
        pose, points = view.scan.T_map_sensor, view.scan.points.astype(np.float64)
        scans.append((points @ pose[:3, :3].T + pose[:3, 3], tuple(pose[:3, 3].tolist())))
    return scans


def adversarial_scans() -> list[Scan]:
    """Rays along cell faces and edges, through corners, of no length, tiny slopes; origins on corners and far away."""
    scans = []
    for shift in (0.0, 1e6, -65536.0):
        origin = np.array([shift, 0.0, 0.5])
        whole = np.stack(np.meshgrid(*[np.arange(-9, 10, 3)] * 3), axis=-1).reshape(-1, 3).astype(np.float64)
        slopes = np.array([[40, 1e-9, 0], [40, -1e-15, 1e-300], [-40, 1e-7, -1e-12], [0, 0, 0], [300, 300, 300]])
        ends = origin + np.concatenate([whole, whole + 0.5, 16 * whole, slopes])
        scans += [(ends, tuple(origin.tolist())), (ends, tuple((origin + 1e-6).tolist()))]
    return scans


def maps_after(
    scans: list[Scan], engines: list[str], passes: int, resolution_m: float, depth: int = 16
) -> list[rayvox.OccupancyMap]:
    maps = [rayvox.OccupancyMap(resolution_m, depth) for _ in engines]
    for _ in range(passes):
        for points, origin in scans:
            for engine, occupancy_map in zip(engines, maps, strict=True):
                occupancy_map.insert_scan(points, origin=origin, engine=engine)  # type: ignore[arg-type]
        first = maps[0].to_bytes()
        assert all(other.to_bytes() == first for other in maps[1:])
    return maps


@pytest.mark.parametrize("engine", OTHER_ENGINES)
@pytest.mark.parametrize("resolution_m", [0.1, 0.5])
def test_random_scans_give_the_same_map(engine: str, resolution_m: float) -> None:
    maps_after(random_scans(3), ["dda", engine], 2, resolution_m)


@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_depth_images_give_the_same_map_until_saturated(engine: str) -> None:
    maps_after(depth_scans(), ["dda", engine], 9, 0.05)


@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_a_room_gives_the_same_map_until_saturated_and_after_clearing(engine: str) -> None:
    origin = np.array([0.31, -0.22, 0.4])
    points = room_scan(np.random.default_rng(5), 4000, 3.0, origin).astype(np.float64)
    scans = [(points, tuple(origin.tolist()))]
    plain, other = maps_after(scans, ["dda", engine], 8, 0.1)
    for occupancy_map, name in ((plain, "dda"), (other, engine)):
        occupancy_map.clear_box((-0.5, -0.5, -0.5), (0.8, 0.8, 0.8))
        occupancy_map.insert_scan(scans[0][0] * 0.7, origin=scans[0][1], engine=name)  # type: ignore[arg-type]
    assert plain.to_bytes() == other.to_bytes()


@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_adversarial_rays_give_the_same_map(engine: str) -> None:
    maps_after(adversarial_scans(), ["dda", engine], 7, 1.0, depth=21)


@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_very_long_and_very_fine_rays_give_the_same_map(engine: str) -> None:
    rng = np.random.default_rng(11)
    long_rays = rng.normal(size=(20, 3))
    long_rays *= 90_000 / np.linalg.norm(long_rays, axis=1, keepdims=True)
    maps_after([(long_rays, (0.1, 0.2, 0.3))], ["dda", engine], 2, 1.0, depth=21)
    maps_after([(rng.normal(size=(500, 3)) * 0.2 + 1e3, (1e3, 1e3, 1e3))], ["dda", engine], 7, 0.001, depth=21)


@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_a_shallow_octree_gives_the_same_map(engine: str) -> None:
    rng = np.random.default_rng(2)
    maps_after([(rng.uniform(-7.9, 7.9, (800, 3)), (0.2, 0.3, 0.1))], ["dda", engine], 7, 1.0, depth=4)


@pytest.mark.parametrize("engine", OTHER_ENGINES)
@pytest.mark.parametrize("instruction_set", ["avx512", "avx2", "portable"])
def test_instruction_sets_and_thread_counts_give_the_same_map(engine: str, instruction_set: str) -> None:
    code = f"""
import numpy as np, rayvox
from tests.property.test_engine_equality import maps_after, random_scans
for threads in (1, 2, 5):
    rayvox.set_thread_count(threads)
    maps_after(random_scans(9, 3), ["dda", {engine!r}], 7, 0.2)
print("same")
"""
    environment = os.environ | {"RAYVOX_SIMD": instruction_set}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300)
    if "not known here" in done.stderr:
        pytest.skip(f"this processor has no {instruction_set}")
    assert done.stdout.strip() == "same", done.stderr


def test_the_embree_engine_walks_less_where_space_is_saturated() -> None:
    # Rays so dense that they leave no voxel out; the ball's rim, where they end, can still change.
    rng = np.random.default_rng(1)
    plain, embree = rayvox.OccupancyMap(0.1), rayvox.OccupancyMap(0.1)
    for _ in range(9):
        directions = rng.normal(size=(150_000, 3))
        ends = directions / np.linalg.norm(directions, axis=1, keepdims=True) * 6.0
        walked = plain.insert_scan(ends, engine="dda").statistics.voxel_steps
        statistics = embree.insert_scan(ends, engine="embree").statistics
    assert plain.to_bytes() == embree.to_bytes()
    assert statistics.voxel_steps < 0.5 * walked
    assert statistics.bvh_node_count > 0


def test_without_embree_the_error_says_what_to_install_and_the_map_is_unchanged() -> None:
    code = """
import numpy as np, rayvox
import rayvox.embree_library as library
library.shipped_libraries = lambda: []
m = rayvox.OccupancyMap(0.1)
try:
    m.insert_scan(np.ones((3, 3)), engine="embree")
except rayvox.EngineUnavailableError as error:
    assert "pip install embreex" in str(error)
    assert m.revision == 0
    m.insert_scan(np.ones((3, 3)), engine="dda")
    print("refused")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    if done.returncode == 0 and not done.stdout:
        pytest.skip("this system has an Embree of its own")
    assert done.stdout.strip() == "refused", done.stderr
