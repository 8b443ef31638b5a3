"""Robots against a map: rigid poses near walls, one thread, beside Coal's octree query; verdicts compared.

    python -m benchmarks.robot_queries [--write NAME]

Needs the sample data (tests/support/datasets.py) and `pip install coal`. A robot at its zero configuration is one rigid
mesh for both. Coal: BVHModelOBB against its OcTree, break_distance 0, one pass; rayvox: best of five, as its batches
take less time than a scheduler's slice.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import numpy.typing as npt
import rayvox
from rayvox.robot import Link, LinkGeometry, Robot

from benchmarks.report import print_table, provenance, write_results
from tests.support.datasets import data_folder
from tests.support.robots import REAL_ROBOTS

FloatArray = npt.NDArray[np.float64]
POSES = 400
SPREAD_M = 0.8  # of robots around occupied cells


def occupied_centres(map_snapshot: rayvox.MapSnapshot) -> FloatArray:
    """Centres of all occupied finest-level cells, (n, 3) metres."""
    keys, depth, log_odds = map_snapshot.leaves()
    occupied = log_odds >= 0
    wide = 1 << (map_snapshot.depth - depth[occupied].astype(np.int64))
    cells = []
    for size in np.unique(wide):
        inside = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), -1).reshape(-1, 3)
        cells.append((keys[occupied][wide == size][:, None] + inside).reshape(-1, 3))
    return np.asarray((np.concatenate(cells) + 0.5) * map_snapshot.resolution_m, dtype=np.float64)


def rigid(robot: Robot) -> Robot:
    poses = robot.link_poses(robot.configuration())[0]
    meshes = [link.mesh.transformed(T) for link, T in zip(robot.links, poses, strict=True) if link.geometries]
    mesh = rayvox.TriangleMesh.concatenate(meshes)
    return Robot(robot.name, [Link("body", (LinkGeometry("mesh", mesh),))], [])


def poses_near(centres: FloatArray, rng: np.random.Generator) -> FloatArray:
    T = np.tile(np.eye(4), (POSES, 1, 1))
    angle = rng.uniform(0, 2 * np.pi, POSES)
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -T[:, 1, 0]
    T[:, :3, 3] = centres[rng.integers(len(centres), size=POSES)] + rng.normal(0, SPREAD_M, (POSES, 3))
    return T


class CoalQuery:
    """The same question to Coal."""

    def __init__(self, coal: Any, tree: Any, mesh: rayvox.TriangleMesh) -> None:
        self._coal, self._tree = coal, tree
        self._model = coal.BVHModelOBB()
        self._model.beginModel(len(mesh.triangles), len(mesh.vertices))
        for corners in mesh.vertices[mesh.triangles]:
            self._model.addTriangle(*corners)
        self._model.endModel()
        self._request = coal.CollisionRequest()
        self._request.break_distance = 0.0

    def check(self, T: FloatArray) -> tuple[npt.NDArray[np.bool_], float]:
        coal, placed = self._coal, [self._coal.Transform3s(t[:3, :3].copy(), t[:3, 3].copy()) for t in T]
        started = time.perf_counter()
        hit = [
            coal.collide(self._model, t, self._tree, coal.Transform3s(), self._request, coal.CollisionResult())
            for t in placed
        ]
        return np.array(hit) > 0, time.perf_counter() - started


def measure(robot: Robot, map_snapshot: rayvox.MapSnapshot, centres: FloatArray, coal: Any, tree: Any) -> list[str]:
    body = rigid(robot)
    checker = rayvox.CollisionChecker(map_snapshot, body)
    T = poses_near(centres, np.random.default_rng(0))
    verdicts = checker.check(T_map_base=T).verdicts == 1
    theirs = CoalQuery(coal, tree, body.links[0].mesh)
    row = [robot.name, f"{body.triangle_count:,}", str(int((theirs.check(T)[0] != verdicts).sum()))]
    for chosen in (T[~verdicts], T[verdicts]):
        times = []
        for _ in range(5):
            started = time.perf_counter()
            checker.check(T_map_base=chosen)
            times.append(time.perf_counter() - started)
        coal_s = theirs.check(chosen)[1]
        row += [f"{1e6 * t / len(chosen):.1f}" for t in (min(times), coal_s)] + [f"{coal_s / min(times):.1f}"]
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", metavar="NAME", help="also write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    import coal

    rayvox.set_thread_count(1)
    data = data_folder()
    if data is None:
        parser.error("the sample data is not here")
    map_snapshot = rayvox.OccupancyMap.load(str(data / "octomap_maps" / "fr_079.bt")).snapshot()
    centres = occupied_centres(map_snapshot)
    tree = coal.makeOctree(np.ascontiguousarray(centres), map_snapshot.resolution_m)
    rows = []
    for name in REAL_ROBOTS:
        folder = data / "robots" / name
        robot = Robot.from_urdf(min(folder.rglob("*.urdf")), root=folder)
        rows.append(measure(robot, map_snapshot, centres, coal, tree))
    columns = ["robot", "triangles", "verdicts that differ", "free us", "Coal", "ratio", "hit us", "Coal", "ratio"]
    print_table(columns, rows)
    if arguments.write:
        write_results(arguments.write, provenance(), {"columns": columns, "rows": rows})


if __name__ == "__main__":
    main()
