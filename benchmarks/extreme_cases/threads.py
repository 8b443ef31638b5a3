"""The same answers from one to eight threads."""

from __future__ import annotations

import functools

import numpy as np
import rayvox

from benchmarks.collision_configurations import crossing_poses, mesh_of
from benchmarks.extreme_cases.case import Case, Outcome
from benchmarks.extreme_cases.meshes import random_corners


def _answers() -> list[bytes]:
    rng = np.random.default_rng(41)
    found = []
    ends = rng.normal(size=(12_000, 3)) * 4
    for engine in rayvox.ENGINES:
        occupancy_map = rayvox.OccupancyMap(0.1)
        for origin in ((0.01, 0.02, 0.03), (1.0, -0.5, 0.25)):
            occupancy_map.insert_scan(ends, origin=origin, engine=engine)
        found.append(occupancy_map.to_bytes())
    hits = occupancy_map.cast_rays(np.zeros((2000, 3)), ends[:2000], 10.0)
    found += [np.ascontiguousarray(hits.t_m).tobytes(), np.ascontiguousarray(hits.hit).tobytes()]
    a, b = (mesh_of(random_corners(rng, 300) * 2) for _ in range(2))
    poses = crossing_poses(a, b, rng, 300)
    poses[:, :3, 3] += rng.normal(0, 0.6, (300, 3))
    bvhs = [rayvox.CollisionMesh(m.vertices, m.triangles).bvh() for m in (a, b)]
    contacts = rayvox.collide(*bvhs, poses, contacts=True)
    return [*found, contacts.colliding.tobytes(), contacts.pose.tobytes(), contacts.triangles.tobytes()]


def _answers_of(threads: int) -> list[bytes]:
    before = rayvox.thread_count()
    rayvox.set_thread_count(threads)
    try:
        return _answers()
    finally:
        rayvox.set_thread_count(before)


@functools.cache
def _answers_of_one() -> list[bytes]:
    return _answers_of(1)


def _same(threads: int) -> Outcome:
    expected, found = _answers_of_one(), _answers_of(threads)
    return Outcome(len(found), sum(x != y for x, y in zip(found, expected, strict=True)))


def cases() -> list[Case]:
    """One to eight."""
    must = "maps, ray hits and contacts are those of one thread, byte for byte"
    return [
        Case("threads", f"{n} thread{'s' if n > 1 else ''}", must, lambda n=n: _same(n), takes_seconds=True)
        for n in range(1, 9)
    ]
