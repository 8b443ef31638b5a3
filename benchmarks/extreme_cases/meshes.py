"""Mesh against mesh at the extremes: scales, places, slivers, zero areas; Coal and FCL on the same placements."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.collision_configurations import Configurations, judged, mesh_of, near_touching, random_rotations, size_m
from benchmarks.extreme_cases.case import Case, Outcome, PeerOutcome
from benchmarks.peers.mesh_peers import Peer, PeerUnavailableError, run_peer
from benchmarks.robot_meshes import Mesh

FloatArray = NDArray[np.float64]
EXACT = "every traversal, float32 and half-float slabs: no wrong verdict"
TRAVERSALS: tuple[dict[str, Any], ...] = (
    {"traversal": "hybrid"},
    {"traversal": "1vs16", "k": 26},
    {"traversal": "4vs4", "k": 18},
    {"traversal": "simd_binary", "k": 24},
    {"traversal": "binary", "k": 14},
    {"traversal": "hybrid", "leaf_size": 1},
)


def ours(load: Callable[[], Configurations]) -> Outcome:
    given, checked, wrong = load(), 0, 0
    for chosen in TRAVERSALS:
        for slabs in ("float16", "float32"):
            a, b = (
                rayvox.CollisionMesh(m.vertices, m.triangles).bvh(slabs=slabs, **chosen) for m in (given.a, given.b)
            )
            wrong += given.wrong(rayvox.collide(a, b, given.poses))
            checked += given.checked
    return Outcome(checked, wrong)


def theirs(peer: Peer, load: Callable[[], Configurations]) -> PeerOutcome:
    given = load()
    try:
        _, verdicts = run_peer(peer, given.a, given.poses, 1, given.b)
    except PeerUnavailableError:
        return "not installed"
    except (OSError, RuntimeError, ValueError) as error:  # it crashed
        return f"fails: {type(error).__name__}"
    return Outcome(given.checked, given.wrong(verdicts))


def mesh_case(topic: str, name: str, load: Callable[[], Configurations], must_hold: str = EXACT) -> Case:
    once = functools.cache(load)
    peers = {"Coal": lambda: theirs("coal", once), "FCL": lambda: theirs("fcl", once)}
    return Case(topic, name, must_hold, lambda: ours(once), peers=peers)


def random_corners(rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 3, 3) triangles in a ball of about a metre across."""
    corners: FloatArray = rng.uniform(-0.3, 0.3, (count, 1, 3)) + rng.normal(0, 0.15, (count, 3, 3))
    return corners


def needle_corners(rng: np.random.Generator, count: int, aspect: float) -> FloatArray:
    """Triangles a metre long and 1/aspect wide."""
    corners = random_corners(rng, count)
    along = rng.normal(size=(count, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    corners[:, 1] = corners[:, 0] + along
    corners[:, 2] = corners[:, 0] + along * rng.uniform(0, 1, (count, 1)) + rng.normal(size=(count, 3)) / aspect
    return corners


def flat_corners(rng: np.random.Generator, count: int) -> FloatArray:
    """Triangles without area: segments and points."""
    corners = random_corners(rng, count)
    corners[:, 2] = corners[:, 1]
    corners[::3] = corners[::3, :1]
    return corners


def _scaled(scale: float) -> Configurations:
    rng = np.random.default_rng(11)
    a, b = (mesh_of(random_corners(rng, 10) * scale) for _ in range(2))
    return near_touching(a, b, rng, 120)


def _far(offset_m: float) -> Configurations:
    """Vertices far from their own frames' origins; the poses bring the meshes together."""
    rng = np.random.default_rng(12)
    a, b = (mesh_of(random_corners(rng, 8) + np.array(d) * offset_m) for d in ([1, -1, 0.5], [-1, 1, 1]))
    # A pose's translation of that size has a spacing of 1e-9 m at 1e7 m; the placements are what it says.
    offsets = (-1e-2, -1e-3, -1e-6, 1e-6, 1e-3, 1e-2)
    return near_touching(a, b, rng, 120, offsets)


def _needles(aspect: float) -> Configurations:
    """Needles against needles and ordinary triangles; what meets only needles slips through when moved further."""
    rng = np.random.default_rng(13)
    a = np.concatenate([random_corners(rng, 8), needle_corners(rng, 4, aspect)])
    return near_touching(mesh_of(a), mesh_of(needle_corners(rng, 8, aspect)), rng, 120)


def _zero_area() -> Configurations:
    """Segments and points, a third of them on the other mesh's triangles or just beside."""
    rng = np.random.default_rng(14)
    return near_touching(mesh_of(random_corners(rng, 12)), mesh_of(flat_corners(rng, 9)), rng, 160)


def _zero_area_both() -> Configurations:
    """Segments that cross segments exactly: on a grid, by whole translations."""
    rng = np.random.default_rng(15)
    corners = rng.integers(-2, 3, (12, 3, 3)).astype(np.float64)
    corners[:, 2] = corners[:, 1]
    poses = np.tile(np.eye(4), (400, 1, 1))
    poses[:, :3, 3] = rng.integers(-3, 4, (400, 3))
    return judged(mesh_of(corners[:6]), mesh_of(corners[6:]), poses, -1.0, touching_m=1e-9)


def _too_large() -> Outcome:
    """Meshes whose products of three lengths overflow float32 are refused."""
    wrong, sizes = 0, (1.01e11, 1e15, 1e200, np.inf, np.nan)
    for size in sizes:
        try:
            rayvox.CollisionMesh([[0, 0, 0], [1, 0, 0], [0, size, 0]], [[0, 1, 2]])
            wrong += 1
        except rayvox.InvalidInputError:
            pass
    return Outcome(len(sizes), wrong)


def _far_pose() -> Outcome:
    """Poses that carry a mesh out of reach, as far as numbers go."""
    cube, poses = cube_mesh(), np.tile(np.eye(4), (8, 1, 1))
    poses[:, 0, 3] = [1e10, 1e38, 1e39, 1e100, 1e160, 1e300, 1.7e308, -1.7e308]
    poses[:, 1, 3] = -poses[:, 0, 3]
    wrong = 0
    for chosen in TRAVERSALS:
        bvh = rayvox.CollisionMesh(cube.vertices, cube.triangles).bvh(**chosen)
        wrong += int(rayvox.collide(bvh, bvh, poses).sum())
    return Outcome(len(poses) * len(TRAVERSALS), wrong)


def _one_triangle() -> Configurations:
    rng = np.random.default_rng(16)
    return near_touching(mesh_of(random_corners(rng, 1)), mesh_of(random_corners(rng, 1)), rng, 400)


def _identity(scale: float, offset_m: float) -> Configurations:
    """The same object twice in one place."""
    rng = np.random.default_rng(17)
    mesh = mesh_of(np.concatenate([random_corners(rng, 10), needle_corners(rng, 5, 1e8)]) * scale + offset_m)
    return judged(mesh, mesh, np.eye(4)[None], 0.0, collides=True)


def _mixed_sizes(ratio: float) -> Configurations:
    """Triangles of a metre and `ratio` times smaller in one mesh: half floats of the large ones' unit underflow."""
    rng = np.random.default_rng(18)
    small = random_corners(rng, 8) * ratio + rng.uniform(-0.3, 0.3, (8, 1, 3))
    a = mesh_of(np.concatenate([random_corners(rng, 3), small]))
    return near_touching(a, mesh_of(random_corners(rng, 8) * ratio), rng, 120, undecided=1e-13)


def _tiny_apart(offset: float) -> Configurations:
    """Two cubes of a metre face to face, edge to edge, corner to corner, so far apart or inside."""
    rng = np.random.default_rng(19)
    cube = cube_mesh()
    sides = np.array([[1, 0.25, 0.375], [1, 1, 0.375], [1, 1, 1], [-1, 0.5, -0.125], [0.25, -1, -1]])
    poses = np.tile(np.eye(4), (len(sides), 1, 1))
    poses[:, :3, 3] = sides + np.where(np.abs(sides) == 1, np.sign(sides) * offset, 0)
    assert size_m(cube) > 1
    found = judged(cube, cube, poses, -1.0, touching_m=1e-12)
    spun = near_touching(cube, cube, rng, 100, (offset,), undecided=abs(offset) * 1e-4)
    return Configurations(
        cube,
        cube,
        np.concatenate([found.poses, spun.poses]) if offset else found.poses,
        np.concatenate([found.collides, spun.collides]) if offset else found.collides,
        np.concatenate([found.decided, spun.decided]) if offset else found.decided,
    )


def cube_mesh(edge_m: float = 1.0) -> Mesh:
    """Twelve triangles around the origin."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64) - 0.5
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]
    return Mesh("cube", corners * edge_m, np.array(triangles, dtype=np.int64))


def _contained() -> Configurations:
    """A small closed cube inside a large one, anywhere it fits."""
    rng = np.random.default_rng(20)
    poses = np.tile(np.eye(4), (100, 1, 1))
    poses[:, :3, :3] = random_rotations(rng, 100)
    poses[:, :3, 3] = rng.uniform(-0.3, 0.3, (100, 3))
    return judged(cube_mesh(), cube_mesh(0.2), poses, 0.0, collides=True)


def cases() -> list[Case]:
    """All about meshes."""
    found = [
        mesh_case("half-float slabs", f"meshes of {s:g} m", lambda s=s: _scaled(s))
        for s in (1e-60, 1e-45, 1e-40, 1e-30, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9, 5e10)
    ]
    found += [
        mesh_case("half-float slabs", f"triangles 1 m and {r:g} m in one mesh", lambda r=r: _mixed_sizes(r))
        for r in (1e-3, 1e-6)
    ]
    found += [mesh_case("translation", f"mesh vertices {m:g} m out", lambda m=m: _far(m)) for m in (1e3, 1e5, 1e6, 1e7)]
    found.append(Case("translation", "poses from 1e10 to 1.7e308 m", "no collision far away", _far_pose))
    found += [
        mesh_case("needles", f"triangles of aspect {aspect:g}", lambda a=aspect: _needles(a))
        for aspect in (1e4, 1e6, 1e8)
    ]
    found += [
        mesh_case("zero area", "segments and points against triangles", _zero_area),
        mesh_case("zero area", "segments that cross or touch exactly", _zero_area_both),
        mesh_case("one triangle", "one triangle against one", _one_triangle),
        mesh_case("same object", "at the identity, 1 m", lambda: _identity(1.0, 0.0)),
        mesh_case("same object", "at the identity, 1e-6 m", lambda: _identity(1e-6, 0.0)),
        mesh_case("same object", "at the identity, vertices 1e7 m out", lambda: _identity(1.0, 1e7)),
        Case("half-float slabs", "coordinates beyond 1e11 m", "InvalidInputError", _too_large),
        mesh_case("solids", "a cube inside a cube", _contained),
    ]
    for offset in (-1e-9, 0.0, 1e-9, 1e-6, 1e-3):
        name = f"cubes {abs(offset):g} m {'inside' if offset < 0 else 'apart'}" if offset else "cubes that just touch"
        found.append(mesh_case("touching", name, lambda o=offset: _tiny_apart(o)))
    return found
