"""Scenes and the building."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from rayvox.simulation import Scene, Sphere, make_building, robot_poses
from rayvox.simulation.robot_path import ROBOT_GROUND_CLEARANCE_M, ROBOT_SIZE_M


def fan(count: int, seed: int) -> NDArray[np.float64]:
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    unit: NDArray[np.float64] = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return unit


def test_the_nearest_of_several_solids_is_measured() -> None:
    scene = Scene([Sphere.at(5.0, 0.0, 0.0, 1.0), Sphere.at(3.0, 0.0, 0.0, 0.5), Sphere.at(9.0, 0.0, 0.0, 1.0)])
    forward = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(scene.cast_rays((0.0, 0.0, 0.0), forward), [2.5, np.inf])


def test_culling_and_ordering_change_no_range_in_the_building() -> None:
    scene, directions = make_building(), fan(3000, seed=1)
    for origin in (np.array([-2.0, 0.0, 1.1]), np.array([7.0, 1.0, 0.4]), np.array([0.0, 0.0, 30.0])):
        intervals = [shape.ray_interval(origin, directions) for shape in scene.shapes]
        brute = np.min([np.where((a <= b) & (b >= 0.0), np.maximum(a, 0.0), np.inf) for a, b in intervals], axis=0)
        np.testing.assert_array_equal(scene.cast_rays(origin, directions), brute)


def test_what_a_ray_meets_is_a_surface_of_the_building() -> None:
    scene, directions, origin = make_building(), fan(3000, seed=2), np.array([6.6, 0.3, 1.1])
    ranges = scene.cast_rays(origin, directions)
    met = np.isfinite(ranges)
    hits = origin + ranges[met, None] * directions[met]
    assert 0.5 < met.mean() < 1.0, "windows and the doorway let some rays out"
    assert np.abs(scene.signed_distance(hits)).max() < 1e-9
    before = origin + 0.999 * ranges[met, None] * directions[met]
    assert not scene.is_occupied(before).any()


def test_walls_are_occupied_and_doorways_are_not() -> None:
    scene = make_building()
    inside_wall, doorway, room = (-2.0, 1.0, 1.0), (-5.5, 1.0, 1.0), (-6.0, 3.0, 1.0)
    assert scene.is_occupied(np.array([inside_wall, doorway, room])).tolist() == [True, False, False]


def test_the_robot_touches_nothing_on_its_drive() -> None:
    length, width, height = ROBOT_SIZE_M
    x, y, z = (np.linspace(-half, half, 9) for half in (length / 2, width / 2, height / 2))
    body = np.stack(np.meshgrid(x, y, z + ROBOT_GROUND_CLEARANCE_M + height / 2), axis=-1).reshape(-1, 3)
    scene = make_building()
    for T_map_base in robot_poses(150):
        clearance = scene.signed_distance(body @ T_map_base[:3, :3].T + T_map_base[:3, 3]).min()
        assert clearance > 0.05, f"{clearance:.3f} m at {T_map_base[:2, 3]}"
