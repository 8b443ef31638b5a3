"""Every solid against brute force: marching along the ray by its own signed distance, and sampling its surface."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox.simulation import Box, Cylinder, Placement, Scene, Shape, Sphere, rotation_from_rpy

TURNED = rotation_from_rpy(roll_rad=0.4, pitch_rad=-0.7, yaw_rad=2.1)
SHAPES: dict[str, Shape] = {
    "axis-aligned box": Box.between((-0.5, -0.3, -0.2), (0.6, 0.4, 0.9)),
    "turned box": Box(Placement(np.array([0.2, -0.1, 0.3]), TURNED), np.array([0.5, 0.05, 0.8])),
    "upright cylinder": Cylinder.upright(0.1, 0.2, -0.6, 0.5, 0.35),
    "turned cylinder": Cylinder(Placement(np.array([-0.2, 0.1, 0.0]), TURNED), 0.2, 0.7),
    "sphere": Sphere.at(0.3, -0.2, 0.1, 0.6),
}


def random_rays(count: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    random = np.random.default_rng(seed)
    origins = random.normal(size=(count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = random.uniform(-0.8, 0.8, size=(count, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def march(shape: Shape, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    travelled = np.zeros(origins.shape[0])
    for _ in range(2000):
        step = shape.signed_distance(origins + travelled[:, None] * directions)
        travelled += np.where(travelled < 10.0, np.maximum(step, 0.0), 0.0)
    return np.where(travelled < 10.0, travelled, np.inf)


@pytest.mark.parametrize("name", SHAPES)
def test_a_ray_meets_a_solid_where_marching_by_its_distance_ends(name: str) -> None:
    origins, directions = random_rays(300, seed=3)
    expected = march(SHAPES[name], origins, directions)
    cast = Scene([SHAPES[name]]).cast_rays(origins, directions)
    # Marching stalls next to rays that graze the solid; those are decided by the exact test alone.
    enter, leave = SHAPES[name].ray_interval(origins, directions)
    clear = np.abs(leave - enter) > 1e-3
    assert 30 < np.isfinite(cast[clear]).sum() < clear.sum()
    np.testing.assert_allclose(cast[clear], expected[clear], atol=1e-6)


@pytest.mark.parametrize("name", SHAPES)
def test_rays_from_one_origin_and_from_their_own_origins_agree(name: str) -> None:
    origin = np.array([1.5, 2.0, -1.0])
    _, directions = random_rays(500, seed=4)
    scene = Scene([SHAPES[name]])
    shared = scene.cast_rays(origin, directions)
    own = scene.cast_rays(np.tile(origin, (500, 1)), directions)
    np.testing.assert_allclose(shared, own, rtol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_the_signed_distance_is_a_distance(name: str) -> None:
    random = np.random.default_rng(5)
    points, others = random.uniform(-1.5, 1.5, (2, 4000, 3))
    shape = SHAPES[name]
    here, there = shape.signed_distance(points), shape.signed_distance(others)
    assert (np.abs(here - there) <= np.linalg.norm(points - others, axis=1) + 1e-12).all()
    assert (here < 0.0).any()
    assert (here > 0.0).any()


@pytest.mark.parametrize("name", SHAPES)
def test_a_ray_that_starts_inside_measures_zero(name: str) -> None:
    shape = SHAPES[name]
    assert Scene([shape]).cast_rays(shape.center, np.array([[0.0, 0.6, 0.8]]))[0] == 0.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ray_along_an_axis_divides_by_no_zero(axis: int) -> None:
    direction = np.zeros((1, 3))
    direction[0, axis] = 1.0
    shapes: list[Shape] = [
        Box.between((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)),
        Cylinder.upright(0.0, 0.0, -0.5, 0.5, 0.5),
        Sphere.at(0.0, 0.0, 0.0, 0.5),
    ]
    with np.errstate(invalid="raise", divide="raise"):
        for shape in shapes:
            assert Scene([shape]).cast_rays(-2.0 * direction[0], direction)[0] == pytest.approx(1.5)
            beside = -2.0 * direction[0] + np.roll(direction[0], 1)
            assert Scene([shape]).cast_rays(beside, direction)[0] == np.inf
