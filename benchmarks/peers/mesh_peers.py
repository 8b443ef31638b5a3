"""Coal and FCL, timed by a driver of their C++ libraries that is compiled here on first use: no binding in between."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.robot_meshes import Mesh

Peer = Literal["coal", "fcl"]

_SOURCE = Path(__file__).with_name("mesh_driver.cpp")
_BUILD = Path(__file__).resolve().parents[2] / "build" / "benchmarks"


class PeerUnavailableError(RuntimeError):
    """No compiler, or the library is not installed."""


def _flags(peer: Peer) -> list[str]:
    if peer == "fcl":
        # Packaged without -march=native: Eigen's alignment has to be the library's.
        return ["-std=c++14", "-I/usr/include/eigen3", "-lfcl", "-lccd", "-loctomap", "-loctomath"]
    found = importlib.util.find_spec("coal")
    if found is None or found.origin is None:
        raise PeerUnavailableError("pip install coal")
    prefix = next(folder for folder in Path(found.origin).parents if folder.name == "cmeel.prefix")
    libraries = [f"-L{prefix}/lib", "-lcoal", "-loctomap", "-loctomath", f"-Wl,-rpath,{prefix}/lib"]
    return [
        "-std=c++17",
        "-DWITH_COAL",
        "-DCOAL_HAS_OCTOMAP",
        f"-I{prefix}/include",
        "-I/usr/include/eigen3",
        *libraries,
    ]


def build_driver(peer: Peer) -> Path:
    """The compiled driver; raises PeerUnavailableError with what to install. CPATH and LIBRARY_PATH are honoured."""
    driver = _BUILD / f"mesh_driver_{peer}"
    if driver.exists() and driver.stat().st_mtime > _SOURCE.stat().st_mtime:
        return driver
    _BUILD.mkdir(parents=True, exist_ok=True)
    command = [os.environ.get("CXX", "g++"), "-O3", "-DNDEBUG", "-w", str(_SOURCE), "-o", str(driver), *_flags(peer)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (FileNotFoundError, subprocess.CalledProcessError) as error:
        # A compiler that is killed says nothing.
        reason = (getattr(error, "stderr", "").strip() or str(error)).splitlines()[0]
        raise PeerUnavailableError(
            f"{peer}: install g++, libeigen3-dev, libfcl-dev and liboctomap-dev ({reason})"
        ) from error
    return driver


def run_peer(
    peer: Peer,
    mesh: Mesh,
    poses: NDArray[np.float64],
    repeats: int,
    second: Mesh | None = None,
    octomap: Path | None = None,
) -> tuple[dict[str, Any], NDArray[np.bool_]]:
    """Build seconds and microseconds a query of each repeat (one thread, OBB, boolean), and the verdicts.

    What is placed by the poses: `second`, by default a copy of the mesh; or the mesh itself among the occupied voxels
    of `octomap`, a .bt file.
    """
    driver = build_driver(peer)
    with tempfile.TemporaryDirectory() as folder:
        mesh_path, pose_path, verdicts = (Path(folder) / name for name in ("mesh", "poses", "verdicts"))
        _write_mesh(mesh_path, mesh)
        with pose_path.open("wb") as file:
            np.array([len(poses)], dtype=np.int64).tofile(file)
            poses.astype(np.float64).tofile(file)
        command = [str(driver), str(mesh_path), str(pose_path), str(verdicts), str(repeats)]
        if second is not None:
            _write_mesh(Path(folder) / "second", second)
            command.append(str(Path(folder) / "second"))
        elif octomap is not None:
            command.append(str(octomap))
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        measured: dict[str, Any] = json.loads(done.stdout)
        return measured, np.fromfile(verdicts, dtype=np.int8).astype(bool)


def _write_mesh(path: Path, mesh: Mesh) -> None:
    with path.open("wb") as file:
        np.array([len(mesh.vertices), len(mesh.triangles)], dtype=np.int64).tofile(file)
        mesh.vertices.astype(np.float64).tofile(file)
        mesh.triangles.astype(np.int32).tofile(file)
