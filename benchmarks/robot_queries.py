"""Robots against published maps: rigid poses near walls, one thread, beside Coal's and FCL's octree queries.

    python -m benchmarks.robot_queries [--write NAME] [--robots panda,pr2] [--repeats 5]

Needs the sample data (tests/support/datasets.py), `pip install coal`, g++, libfcl-dev, liboctomap-dev, libeigen3-dev. A
robot at its zero configuration is one rigid mesh for all. Poses are free, colliding, and nearly touching
(free, and colliding 1e-6 m further on). Coal (BVHModel<OBB>, break_distance 0) and FCL (the same) run from a C++
driver; all take turns, and each has its best pass. Then a panda at configurations, with self-collision.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from statistics import geometric_mean

import numpy as np
import numpy.typing as npt
import rayvox
from rayvox.robot import Link, LinkGeometry, Robot
from rayvox.self_collision import self_collisions

from benchmarks.peers.mesh_peers import Peer, run_peer
from benchmarks.report import print_table, provenance, write_results
from benchmarks.robot_meshes import Mesh
from tests.support.datasets import data_folder
from tests.support.robots import REAL_ROBOTS

FloatArray = npt.NDArray[np.float64]
MAPS = ("fr_079.bt", "geb079.bt")
PEERS: tuple[Peer, ...] = ("coal", "fcl")
POSES = 400
SPREAD_M = 0.8  # of robots around occupied cells
GAP_M = 1e-6
CONFIGURATIONS = 10_000


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


def load(name: str) -> Robot:
    folder = data_folder()
    assert folder is not None
    return Robot.from_urdf(folder / "robots" / name / "robot.urdf")


def rigid(robot: Robot) -> Robot:
    poses = robot.link_poses(robot.configuration())[0]
    meshes = [link.mesh.transformed(T) for link, T in zip(robot.links, poses, strict=True) if link.geometries]
    mesh = rayvox.TriangleMesh.concatenate(meshes)
    return Robot(robot.name, [Link("body", (LinkGeometry("mesh", mesh),))], [])


def poses_near(centres: FloatArray, rng: np.random.Generator, count: int = POSES) -> FloatArray:
    T = np.tile(np.eye(4), (count, 1, 1))
    angle = rng.uniform(0, 2 * np.pi, count)
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -T[:, 1, 0]
    T[:, :3, 3] = centres[rng.integers(len(centres), size=count)] + rng.normal(0, SPREAD_M, (count, 3))
    return T


def just_apart(checker: rayvox.CollisionChecker, free: FloatArray, colliding: FloatArray) -> FloatArray:
    """Free poses from which a move of GAP_M towards a colliding one collides; rotations are the free ones'."""
    count = min(len(free), len(colliding))
    T, step = free[:count].copy(), colliding[:count, :3, 3] - free[:count, :3, 3]
    near, far = np.zeros(count), np.ones(count)
    moved = T.copy()
    moved[:, :3, 3] += step
    ends = checker.check(T_map_base=moved).verdicts == 1
    while ((far - near) * np.linalg.norm(step, axis=1))[ends].max() > GAP_M:
        middle = (near + far) / 2
        moved[:, :3, 3] = T[:, :3, 3] + middle[:, None] * step
        hit = checker.check(T_map_base=moved).verdicts == 1
        near, far = np.where(hit, near, middle), np.where(hit, middle, far)
    T[:, :3, 3] += near[:, None] * step
    return T[ends]


def best_us(checker: rayvox.CollisionChecker, T: FloatArray, repeats: int) -> float:
    times = []
    for _ in range(3 * repeats):
        started = time.perf_counter()
        checker.check(T_map_base=T)
        times.append(time.perf_counter() - started)
    return 1e6 * min(times) / len(T)


def measure(name: str, octomap: Path, repeats: int) -> list[dict[str, object]]:
    body = rigid(load(name))
    map_snapshot = rayvox.OccupancyMap.load(str(octomap)).snapshot()
    checker = rayvox.CollisionChecker(map_snapshot, body)
    T = poses_near(occupied_centres(map_snapshot), np.random.default_rng(0))
    verdicts = checker.check(T_map_base=T).verdicts == 1
    chosen = {
        "free": T[~verdicts],
        "colliding": T[verdicts],
        "1e-6 m apart": just_apart(checker, T[~verdicts], T[verdicts]),
    }
    mesh = body.links[0].mesh
    rows = []
    for kind, poses in chosen.items():
        row: dict[str, object] = {
            "map": octomap.stem,
            "robot": name,
            "triangles": len(mesh),
            "poses": f"{len(poses)} {kind}",
        }
        ours = best_us(checker, poses, repeats)
        theirs = {}
        for peer in PEERS:
            given = Mesh(name, mesh.vertices, mesh.triangles.astype(np.int64))
            measured, hits = run_peer(peer, given, poses, repeats, octomap=octomap)
            theirs[peer] = min(measured["query_us"])
            row[f"{peer} differs"] = int((hits != (kind == "colliding")).sum())
        ours = min(ours, best_us(checker, poses, repeats))
        row["rayvox us"] = ours
        for peer in PEERS:
            row[f"{peer} us"], row[f"{peer} / rayvox"] = theirs[peer], theirs[peer] / ours
        rows.append(row)
    return rows


def measure_articulated(octomap: Path, repeats: int) -> dict[str, object]:
    robot = load("panda").with_always_touching_allowed(rayvox.links_touch)
    map_snapshot = rayvox.OccupancyMap.load(str(octomap)).snapshot()
    checker, rng = rayvox.CollisionChecker(map_snapshot, robot), np.random.default_rng(0)
    q = robot.sample_configurations(CONFIGURATIONS, rng)
    T = poses_near(occupied_centres(map_snapshot), rng, CONFIGURATIONS)
    answer = checker.check(q, T, self_collision=True)
    row: dict[str, object] = {"map": octomap.stem, "in collision": float((answer.verdicts == 1).mean())}
    assert answer.self_colliding is not None
    row["self-colliding"] = float(answer.self_colliding.mean())
    ways: dict[str, Callable[[], object]] = {
        "map alone": lambda: checker.check(q, T),
        "self-collision alone": lambda: self_collisions(robot, robot.link_poses(q)),
        "both": lambda: checker.check(q, T, self_collision=True),
    }
    for name, ask in ways.items():
        times = []
        for _ in range(repeats):
            started = time.perf_counter()
            ask()
            times.append(time.perf_counter() - started)
        row[f"us, {name}"] = 1e6 * min(times) / CONFIGURATIONS
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", metavar="NAME", help="also write benchmarks/results/NAME.json")
    parser.add_argument("--robots", default=",".join(REAL_ROBOTS))
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    data = data_folder()
    if data is None:
        parser.error("the sample data is not here")
    maps = [data / "octomap_maps" / name for name in MAPS]
    rows = [
        row for path in maps for name in arguments.robots.split(",") for row in measure(name, path, arguments.repeats)
    ]
    _print(rows)
    for kind in ("free", "colliding", "apart"):
        of_kind = [row for row in rows if kind in str(row["poses"])]
        means = [geometric_mean(float(str(row[f"{peer} / rayvox"])) for row in of_kind) for peer in PEERS]
        print(f"{kind}: " + ", ".join(f"{peer} {mean:.1f}" for peer, mean in zip(PEERS, means, strict=True)))
    articulated = [measure_articulated(path, arguments.repeats) for path in maps]
    _print(articulated)
    if arguments.write:
        write_results(arguments.write, provenance(), {"rigid": rows, "articulated": articulated})


def _print(rows: list[dict[str, object]]) -> None:
    print_table(list(rows[0]), [[f"{v:.2f}" if isinstance(v, float) else v for v in row.values()] for row in rows])


if __name__ == "__main__":
    main()
