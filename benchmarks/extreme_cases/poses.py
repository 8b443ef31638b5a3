"""Chains of poses in float64 and in float32."""

from __future__ import annotations

import numpy as np
import rayvox
from numpy.typing import NDArray
from rayvox.robot import Joint, JointMotion, Link, Robot

from benchmarks.collision_configurations import random_rotations
from benchmarks.extreme_cases.case import Case, Outcome
from benchmarks.extreme_cases.meshes import cube_mesh

_LINK_M = 0.3
_TOLERANCE = 1e-5


def _about_z(angles: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    turns = np.tile(np.eye(4, dtype=np.longdouble), (len(angles), 1, 1))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
    turns[:, 1, 0] = np.sin(angles)
    turns[:, 0, 1] = -turns[:, 1, 0]
    return turns


def _offsets(count: int) -> NDArray[np.float64]:
    """Fixed transforms from each joint to the next: turned anyhow, a link's length apart."""
    rng = np.random.default_rng(31)
    offsets = np.tile(np.eye(4), (count, 1, 1))
    offsets[:, :3, :3] = random_rotations(rng, count)
    offsets[:, :3, 3] = rng.normal(size=(count, 3))
    offsets[:, :3, 3] *= _LINK_M / np.linalg.norm(offsets[:, :3, 3], axis=1)[:, None]
    return offsets


def _kinematic_chain(joints: int) -> Outcome:
    """Where the last link of a chain is, against extended precision; worst of 50 configurations, metres."""
    offsets = _offsets(joints)
    links = [Link(f"link_{i}") for i in range(joints + 1)]
    chain = [
        Joint(f"joint_{i}", JointMotion.REVOLUTE, f"link_{i}", f"link_{i + 1}", offset, (0.0, 0.0, 1.0))
        for i, offset in enumerate(offsets)
    ]
    robot = Robot("chain", links, chain)
    q = np.random.default_rng(32).uniform(-np.pi, np.pi, (50, joints))
    found, worst = robot.link_poses(q), 0.0
    for angles, poses in zip(q, found, strict=True):
        exact = np.eye(4, dtype=np.longdouble)
        for offset, turn in zip(offsets, _about_z(angles.astype(np.longdouble)), strict=True):
            exact = exact @ offset.astype(np.longdouble) @ turn
        worst = max(worst, float(np.abs(poses[-1] - exact)[:3, 3].max()))
    return Outcome(len(q), 0, worst)


def _float32_chain(steps: int) -> tuple[NDArray[np.float32], float]:
    """Odometry multiplied up in float32, and how far its position is from float64's."""
    offsets = _offsets(steps)
    single, double = np.eye(4, dtype=np.float32), np.eye(4)
    for offset in offsets:
        single, double = single @ offset.astype(np.float32), double @ offset
    return single, float(np.abs(single - double)[:3, 3].max())


def _float32_lost(steps: int) -> Outcome:
    """What a user loses who multiplies poses up in float32."""
    return Outcome(1, 0, _float32_chain(steps)[1])


def _refused_or_exact() -> Outcome:
    """A pose is refused from a deviation of 1e-5 on; one that is accepted is taken as it stands."""
    checked = wrong = 0
    cube = cube_mesh()
    bvh = rayvox.CollisionMesh(cube.vertices, cube.triangles).bvh()
    for steps in (1, 10, 100, 1000, 5000):
        pose = _float32_chain(steps)[0].astype(np.float64)
        deviation = np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max()
        for stretch in (1.0, 1 + 4.9e-6, 1 + 5.1e-6, 1 - 1e-4):
            stretched = pose.copy()
            stretched[:3, :3] *= stretch
            deviation = np.abs(stretched[:3, :3] @ stretched[:3, :3].T - np.eye(3)).max()
            if abs(deviation - _TOLERANCE) < 1e-9:
                continue
            # Face to face along the pose's own x axis: the placed corner decides, as the matrix has it.
            for gap, expected in ((1e-9, False), (-1e-9, True)):
                corner = np.abs(stretched[0, :3]).sum() / 2
                stretched[:3, 3] = [0.5 + corner + gap, 0.0, 0.0]
                try:
                    verdict = bool(rayvox.collide(bvh, bvh, stretched)[0])
                    wrong += deviation > _TOLERANCE or (verdict and not expected)
                except rayvox.InvalidInputError:
                    wrong += deviation < _TOLERANCE
                checked += 1
    return Outcome(checked, int(wrong))


def cases() -> list[Case]:
    """Float64 chains are exact to rounding; float32 chains are the user's loss, measured."""
    found = []
    for joints in (7, 100):
        # Each joint adds a few roundings to all that is beyond it.
        bound = 2.0**-50 * joints**2 * _LINK_M
        must = "link poses to the rounding of each joint"
        name = f"{joints} joints, float64"
        found.append(Case("pose chains", name, must, lambda n=joints: _kinematic_chain(n), bound, "m"))
    for steps in (100, 1000):
        bound = 2.0**-23 * steps**1.5 * _LINK_M
        must = "nothing of ours: what float32 loses before rayvox sees the pose"
        name = f"{steps:,} steps of 0.3 m multiplied in float32"
        found.append(Case("pose chains", name, must, lambda n=steps: _float32_lost(n), bound, "m"))
    must = "refused where rows deviate by 1e-5, else no gap of 1e-9 m called a collision"
    found.append(Case("pose chains", "float32 poses, stretched", must, _refused_or_exact))
    return found
