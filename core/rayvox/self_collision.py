"""Collisions of a robot's links with each other."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rayvox._native import CancellationToken
from rayvox.collide import collide
from rayvox.errors import QueryCancelledError
from rayvox.robot.robot import Robot

FloatArray = npt.NDArray[np.float64]


def self_collisions(
    robot: Robot, T_map_links: FloatArray, cancellation: CancellationToken | None = None
) -> npt.NDArray[np.bool_]:
    """Whether, at (n, links, 4, 4) poses, two links touch or enclose each other that must not: (n,) bool.

    Pairs are looked at as they come near: bounding spheres, oriented boxes, then the hierarchies. Raises
    QueryCancelledError if that was asked for before it began.
    """
    if cancellation is not None and cancellation.cancelled:
        raise QueryCancelledError("the query was cancelled")
    return robot.self_collision.check(T_map_links).astype(bool)


def links_touch(robot: Robot, configurations: FloatArray, pairs: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Which of (k, 2) pairs of links touch at (n, j) configurations: (n, k) bool; for with_always_touching_allowed."""
    T_base_links = robot.link_poses(configurations)
    touching = np.zeros((len(T_base_links), len(pairs)), dtype=bool)
    for column, pair in enumerate(pairs):
        touching[:, column] = _pair_touches(robot, T_base_links, pair)
    return touching


def _pair_touches(robot: Robot, T_map_links: FloatArray, pair: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    first, second = (robot.links[i].bvh for i in pair)
    if first is None or second is None or len(T_map_links) == 0:
        return np.zeros(len(T_map_links), dtype=bool)
    T_map_first, T_map_second = (T_map_links[:, i] for i in pair)
    T_first_second = np.zeros_like(T_map_first)
    T_first_second[:, :3, :3] = np.swapaxes(T_map_first[:, :3, :3], 1, 2) @ T_map_second[:, :3, :3]
    between = T_map_second[:, :3, 3] - T_map_first[:, :3, 3]
    T_first_second[:, :3, 3] = np.einsum("nji,nj->ni", T_map_first[:, :3, :3], between)
    T_first_second[:, 3, 3] = 1.0
    return collide(first, second, T_first_second)
