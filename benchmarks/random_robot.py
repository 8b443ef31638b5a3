"""Robots that differ with a seed: a base on the floor with a column and an arm of three joints."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from rayvox.robot import Robot


def random_robot(seed: int) -> Robot:
    """The same for the same seed; every length differs by up to a quarter from robot to robot."""
    rng = np.random.default_rng([seed, 7])
    length, width, height, column, arm = np.array([0.6, 0.45, 0.3, 0.5, 0.35]) * rng.uniform(0.8, 1.25, 5)
    radius = 0.05 * rng.uniform(0.8, 1.25)
    links = [
        _link("base", f'<box size="{length} {width} {height}"/>', 0.1 + height / 2),
        _link("column", f'<cylinder radius="{radius}" length="{column}"/>', column / 2),
        *(_link(f"arm{i}", f'<cylinder radius="{0.8 * radius}" length="{arm}"/>', arm / 2) for i in range(2)),
        _link("hand", f'<sphere radius="{1.3 * radius}"/>', 0.0),
    ]
    joints = [
        _joint("turn", "base", "column", 0.1 + height, "0 0 1", "-3.1 3.1"),
        _joint("shoulder", "column", "arm0", column, "0 1 0", "-1.5 1.5"),
        _joint("elbow", "arm0", "arm1", arm, "0 1 0", "-2.2 2.2"),
        _joint("wrist", "arm1", "hand", arm, "0 1 0", "-1 1"),
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(f'<robot name="mobile arm {seed}">{"".join(links + joints)}</robot>', encoding="utf-8")
        return Robot.from_urdf(path)


def _link(name: str, shape: str, z: float) -> str:
    geometry = f'<origin xyz="0 0 {z}"/><geometry>{shape}</geometry>'
    return f'<link name="{name}"><collision>{geometry}</collision></link>'


def _joint(name: str, parent: str, child: str, z: float, axis: str, limits: str) -> str:
    lower, upper = limits.split()
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 {z}"/><axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}"/></joint>'
    )
