"""Wrong answers of collision libraries beside their times: nearly touching, contained, degenerate, far away.

    python -m benchmarks.wrong_answers [--poses N] [--write NAME]

Two meshes, the second placed at N poses a row, boolean, one thread. Truth: the least gap of any two triangles in
extended precision (collision_configurations.py), or by construction. Coal and FCL run from peers/mesh_driver.cpp with
OBB (Coal with break_distance 0); trimesh asks FCL through python-fcl (OBBRSS); Open3D's is_intersecting takes moved
meshes, of which the moving is timed too. Their solids are surfaces: none offers containment. What is not installed is
left out and said to be.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.collision_configurations import Configurations, judged, mesh_of, near_touching, random_rotations
from benchmarks.extreme_cases.meshes import flat_corners, needle_corners, random_corners
from benchmarks.peers.mesh_peers import Peer, PeerUnavailableError, run_peer
from benchmarks.report import print_table, provenance, write_results
from benchmarks.robot_meshes import Mesh

Bools = NDArray[np.bool_]
# Verdicts and microseconds a query; None where the library is not there.
Answer = tuple[Bools, float]
_TRAVERSALS = ("hybrid", "1vs16", "4vs4", "simd_binary", "binary")
_REPEATS = 5


def bumpy_sphere(rows: int, radius_m: float = 1.0) -> Mesh:
    """A closed mesh of about 4 rows^2 triangles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1)[1:-1], np.linspace(0, 2 * np.pi, 2 * rows + 1)[:-1])
    theta, phi = theta.T, phi.T
    r = radius_m * (1 + 0.1 * np.sin(5 * theta) * np.cos(4 * phi))
    ring = r[..., None] * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    width, count = 2 * rows, (rows - 1) * 2 * rows
    poles = np.array([[0, 0, radius_m], [0, 0, -radius_m]])
    triangles = []
    for i in range(width):
        j = (i + 1) % width
        triangles += [[count, i, j], [count + 1, count - width + j, count - width + i]]
        for row in range(rows - 2):
            a, b, c, d = row * width + i, (row + 1) * width + i, (row + 1) * width + j, row * width + j
            triangles += [[a, b, c], [a, c, d]]
    return Mesh("bumpy sphere", np.concatenate([ring.reshape(-1, 3), poles]), np.array(triangles, dtype=np.int64))


def _contained(count: int) -> Configurations:
    rng = np.random.default_rng(1)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = random_rotations(rng, count)
    poses[:, :3, 3] = rng.uniform(-0.35, 0.35, (count, 3))
    return judged(bumpy_sphere(10), bumpy_sphere(6, 0.15), poses, 0.0, collides=True)


def situations(count: int) -> Iterator[tuple[str, Configurations]]:
    """The rows."""
    sphere = bumpy_sphere(10)
    for part in (1e-9, 1e-6, 1e-3, 1e-2):
        for name, offset in (("apart", part), ("inside", -part)):
            found = near_touching(sphere, sphere, np.random.default_rng(2), count, (offset,), part * 1e-3)
            yield f"{part:g} of the size {name}", found
    yield "one solid inside another", _contained(count)
    spread = (-1e-2, -1e-3, -1e-6, -1e-8, 1e-8, 1e-6, 1e-3, 1e-2)
    rng = np.random.default_rng(3)
    pairs: dict[str, Callable[[], tuple[NDArray[np.float64], NDArray[np.float64]]]] = {
        "one triangle against one, nearly touching": lambda: (random_corners(rng, 1), random_corners(rng, 1)),
        "segments and points against triangles, nearly touching": lambda: (
            random_corners(rng, 12),
            flat_corners(rng, 9),
        ),
        "needles of aspect 1e8 against them and triangles, nearly touching": lambda: (
            np.concatenate([random_corners(rng, 8), needle_corners(rng, 4, 1e8)]),
            needle_corners(rng, 8, 1e8),
        ),
        "vertices 1e6 m out, nearly touching": lambda: (
            random_corners(rng, 20) + np.array([1e6, -1e6, 5e5]),
            random_corners(rng, 20) - np.array([1e6, 1e6, 1e6]),
        ),
    }
    for name, corners in pairs.items():
        a, b = corners()
        yield name, near_touching(mesh_of(a), mesh_of(b), rng, 2 * count, spread)


def rayvox_answers(given: Configurations, traversal: str) -> Answer:
    """Ours, containment looked for as well."""
    a, b = (
        rayvox.CollisionMesh(m.vertices, m.triangles).bvh(traversal=traversal)  # type: ignore[arg-type]
        for m in (given.a, given.b)
    )
    best = np.inf
    for _ in range(_REPEATS):
        start = time.perf_counter()
        verdicts = rayvox.collide(a, b, given.poses)
        best = min(best, time.perf_counter() - start)
    return verdicts, 1e6 * best / len(given.poses)


def driver_answers(given: Configurations, peer: Peer) -> Answer | None:
    """Coal's or FCL's C++ library."""
    try:
        found, verdicts = run_peer(peer, given.a, given.poses, _REPEATS, given.b)
    except PeerUnavailableError:
        return None
    return verdicts, min(found["query_us"])


def trimesh_answers(given: Configurations) -> Answer | None:
    """FCL through trimesh's collision manager."""
    if importlib.util.find_spec("fcl") is None:
        return None
    import trimesh

    manager = trimesh.collision.CollisionManager()
    manager.add_object("a", trimesh.Trimesh(given.a.vertices, given.a.triangles, process=False))
    b = trimesh.Trimesh(given.b.vertices, given.b.triangles, process=False)
    start = time.perf_counter()
    other = trimesh.collision.CollisionManager()
    other.add_object("b", b)
    verdicts = []
    for pose in given.poses:
        other.set_transform("b", pose)
        verdicts.append(bool(manager.in_collision_other(other)))
    return np.array(verdicts), 1e6 * (time.perf_counter() - start) / len(given.poses)


def open3d_answers(given: Configurations) -> Answer | None:
    """TriangleMesh.is_intersecting, all pairs of triangles; half a second a query is enough."""
    if importlib.util.find_spec("open3d") is None:
        return None
    import open3d

    def mesh_at(mesh: Mesh, pose: NDArray[np.float64]) -> Any:
        vertices = open3d.utility.Vector3dVector(mesh.vertices @ pose[:3, :3].T + pose[:3, 3])
        return open3d.geometry.TriangleMesh(vertices, open3d.utility.Vector3iVector(mesh.triangles.astype(np.int32)))

    a = mesh_at(given.a, np.eye(4))
    start = time.perf_counter()
    verdicts = [bool(a.is_intersecting(mesh_at(given.b, pose))) for pose in given.poses]
    return np.array(verdicts), 1e6 * (time.perf_counter() - start) / len(given.poses)


def contestants() -> dict[str, Callable[[Configurations], Answer | None]]:
    """By name."""
    ours: dict[str, Callable[[Configurations], Answer | None]] = {
        f"rayvox {t}": lambda given, t=t: rayvox_answers(given, t)  # type: ignore[misc]
        for t in _TRAVERSALS
    }
    return ours | {
        "Coal": lambda given: driver_answers(given, "coal"),
        "FCL": lambda given: driver_answers(given, "fcl"),
        "trimesh": trimesh_answers,
        "Open3D": open3d_answers,
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Wrong answers beside times.")
    parser.add_argument("--poses", type=int, default=100)
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header, results, asked = provenance(), [], contestants()
    for name, given in situations(arguments.poses):
        row: dict[str, Any] = {"situation": name, "poses": given.checked, "answers": {}}
        for library, ask in asked.items():
            if (answer := ask(given)) is not None:
                verdicts, query_us = answer
                row["answers"][library] = {"wrong": given.wrong(verdicts), "query_us": query_us}
        results.append(row)
    present = [library for library in asked if any(library in row["answers"] for row in results)]
    cells = [
        [
            row["situation"],
            row["poses"],
            *(f"{row['answers'][n]['wrong']}, {row['answers'][n]['query_us']:.3g} us" for n in present),
        ]
        for row in results
    ]
    print_table(["situation", "checked", *present], cells)
    if absent := [library for library in asked if library not in present]:
        print("not installed:", ", ".join(absent))
    if arguments.write:
        print(write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
