"""OctoMap's C++ library, measured by the driver that is compiled here on first use."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.workloads import Workload
from tests.support.occupancy_oracle import Leaves

_SOURCE = Path(__file__).with_name("octomap_driver.cpp")
_BUILD = Path(__file__).resolve().parents[2] / "build" / "benchmarks"
_LEAF = np.dtype([("key", "<i4", (3,)), ("depth", "<u4"), ("log_odds", "<f4")])
# Linked statically: the templates are then the driver's own, compiled for this machine, not the package's.
_LIBRARIES = ("-Wl,-Bstatic", "-loctomap", "-loctomath", "-Wl,-Bdynamic")


class DriverUnavailableError(RuntimeError):
    """No compiler, or no OctoMap development package."""


def build_driver(openmp: bool) -> Path:
    """The compiled driver; raises DriverUnavailableError with what to install."""
    driver = _BUILD / ("octomap_driver_openmp" if openmp else "octomap_driver")
    if driver.exists() and driver.stat().st_mtime > _SOURCE.stat().st_mtime:
        return driver
    _BUILD.mkdir(parents=True, exist_ok=True)
    flags = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", *(["-fopenmp"] if openmp else [])]
    command = [os.environ.get("CXX", "g++"), *flags, str(_SOURCE), *_LIBRARIES, "-o", str(driver)]
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
    driver = build_driver(openmp)
    with tempfile.TemporaryDirectory() as folder:
        scans, dump = Path(folder) / "scans", Path(folder) / "leaves"
        workload.write(scans)
        command = [str(driver), mode, str(scans), repr(workload.resolution_m), repr(workload.max_range_m), str(passes)]
        done = subprocess.run(command + ([str(dump)] if leaves else []), check=True, capture_output=True, text=True)
        measured: dict[str, Any] = json.loads(done.stdout)
        return measured, _read_leaves(dump) if leaves else None


def _read_leaves(path: Path) -> Leaves:
    """Leaves as the driver dumps them: a leaf above the finest level is keyed by its centre."""
    records = np.fromfile(path, dtype=_LEAF)
    depth = records["depth"].astype(np.uint8)
    size = np.int64(1) << (16 - depth.astype(np.int64))
    keys = records["key"].astype(np.int64) // size[:, None] * size[:, None]
    return Leaves(keys, depth, records["log_odds"].astype(np.float32)).sorted()
