"""OctoMap's C++ library, measured by the driver that is compiled here on first use."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.workloads import Workload
from tests.support.occupancy_oracle import Leaves

_SOURCES = Path(__file__).parent
_BUILD = Path(__file__).resolve().parents[2] / "build" / "benchmarks"
_HIT = np.dtype([("hit", "<u4"), ("centre", "<f4", (3,))])
_LEAF = np.dtype([("key", "<i4", (3,)), ("depth", "<u4"), ("log_odds", "<f4")])
# Linked statically: the templates are then the driver's own, compiled for this machine, not the package's.
_LIBRARIES = ("-Wl,-Bstatic", "-loctomap", "-loctomath", "-Wl,-Bdynamic")


class DriverUnavailableError(RuntimeError):
    """No compiler, or no OctoMap development package."""


def build_driver(name: str, openmp: bool) -> Path:
    """The compiled driver; raises DriverUnavailableError with what to install."""
    source, driver = _SOURCES / f"{name}.cpp", _BUILD / (f"{name}_openmp" if openmp else name)
    if driver.exists() and driver.stat().st_mtime > source.stat().st_mtime:
        return driver
    _BUILD.mkdir(parents=True, exist_ok=True)
    flags = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", *(["-fopenmp"] if openmp else [])]
    command = [os.environ.get("CXX", "g++"), *flags, str(source), *_LIBRARIES, "-o", str(driver)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except FileNotFoundError as error:
        raise DriverUnavailableError(f"no C++ compiler {command[0]!r}: install g++") from error
    except subprocess.CalledProcessError as error:
        reason = error.stderr.strip().splitlines()[0]
        raise DriverUnavailableError(f"the driver does not compile (install liboctomap-dev): {reason}") from error
    return driver


def run_driver(
    workload: Workload, passes: int, *, openmp: bool, mode: Literal["time", "memory"] = "time", leaves: bool = False
) -> tuple[dict[str, Any], Leaves | None]:
    """The driver's measurements, and the tree's leaves after one pass if asked for."""
    driver = build_driver("octomap_driver", openmp)
    with tempfile.TemporaryDirectory() as folder:
        scans, dump = Path(folder) / "scans", Path(folder) / "leaves"
        workload.write(scans)
        command = [str(driver), mode, str(scans), repr(workload.resolution_m), repr(workload.max_range_m), str(passes)]
        done = subprocess.run(command + ([str(dump)] if leaves else []), check=True, capture_output=True, text=True)
        measured: dict[str, Any] = json.loads(done.stdout)
        return measured, _read_leaves(dump) if leaves else None


def cast_rays(
    occupancy_map: rayvox.OccupancyMap,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    max_range_m: float,
) -> tuple[float, NDArray[np.bool_], NDArray[np.float32]]:
    """OctoMap's castRay for n rays through the same map: seconds, whether each hit, and the centre of its voxel."""
    driver = build_driver("octomap_ray_driver", openmp=False)
    with tempfile.TemporaryDirectory() as folder:
        tree, rays, hits = (Path(folder) / name for name in ("map.ot", "rays", "hits"))
        occupancy_map.save(tree)
        np.concatenate([origins, directions], axis=1).astype("<f4").tofile(rays)
        command = [str(driver), str(tree), str(rays), repr(max_range_m), str(hits)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        answers = np.fromfile(hits, dtype=_HIT)
        return float(done.stdout), answers["hit"] != 0, answers["centre"]


def _read_leaves(path: Path) -> Leaves:
    """Leaves as the driver dumps them: a leaf above the finest level is keyed by its centre."""
    records = np.fromfile(path, dtype=_LEAF)
    depth = records["depth"].astype(np.uint8)
    size = np.int64(1) << (16 - depth.astype(np.int64))
    keys = records["key"].astype(np.int64) // size[:, None] * size[:, None]
    return Leaves(keys, depth, records["log_odds"].astype(np.float32)).sorted()
