"""Accuracy against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox import OccupancyMap
from rayvox.robot import Link, LinkGeometry, Robot
from rayvox.robot.primitives import box_mesh
from rayvox.simulation import Box, Scene, Sphere
from rayvox.tune.accuracy import map_accuracy
from rayvox.tune.candidate import MapSettings
from rayvox.tune.ground_truth import ROBOT_COLLIDES, ROBOT_FREE, ROBOT_UNDECIDED, NearestPoint, occupied_centres
from rayvox.tune.map_run import build_map
from rayvox.tune.map_truth import MapTruth
from rayvox.tune.robot_queries import robot_probe, with_detail
from rayvox.tune.scene_truth import SceneTruth, surface_samples

from tests.support.tuning_input import small_part

Points = NDArray[np.float64]


def brute_force_occupied(octree: OccupancyMap) -> Points:
    statistics = octree.statistics()
    assert statistics.bounds_lo_m is not None
    assert statistics.bounds_hi_m is not None
    r = octree.resolution_m
    axes = [
        np.arange(round(lo / r), round(hi / r))
        for lo, hi in zip(statistics.bounds_lo_m, statistics.bounds_hi_m, strict=True)
    ]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    centres = (cells + 0.5) * r
    return np.asarray(centres[octree.states_at(centres) == 2])


def all_distances(points: Points, others: Points) -> Points:
    return np.concatenate(
        [np.linalg.norm(chunk[:, None] - others[None], axis=2).min(axis=1) for chunk in np.array_split(points, 50)]
    )


@pytest.fixture(scope="module")
def octree() -> OccupancyMap:
    return build_map(small_part(1).scans, MapSettings(0.2)).occupancy_map


def test_occupied_centres_are_those_of_all_occupied_cells(octree: OccupancyMap) -> None:
    found, expected = occupied_centres(octree.snapshot()), brute_force_occupied(octree)
    assert {tuple(row) for row in np.round(found, 9)} == {tuple(row) for row in np.round(expected, 9)}


def test_the_nearest_point_is_the_nearest() -> None:
    rng = np.random.default_rng(3)
    points, others = rng.normal(size=(200, 3)), rng.normal(size=(300, 3))
    np.testing.assert_allclose(NearestPoint(others).distance_m(points), all_distances(points, others), atol=1e-12)


def test_accuracy_against_a_scene_is_what_brute_force_counts(octree: OccupancyMap) -> None:
    part = small_part(1)
    assert part.scene is not None
    truth = SceneTruth(part.scene, part.scans, 0.05)
    found = map_accuracy(octree.snapshot(), truth)
    assert found is not None
    centres = brute_force_occupied(octree)
    distance = part.scene.signed_distance(centres)
    gap = all_distances(truth.seen_surface, centres)
    assert len(centres) <= 4000, "nothing is sampled, so that all must agree"
    np.testing.assert_allclose(found.occupied_precision, (distance <= 0.1 * np.sqrt(3)).mean())
    np.testing.assert_allclose(found.stray_p95_m, np.quantile(np.abs(distance), 0.95))
    np.testing.assert_allclose(found.gap_p95_m, np.quantile(gap, 0.95))
    np.testing.assert_allclose(found.error_p95_m, max(found.gap_p95_m, found.stray_p95_m))
    both = [np.quantile(gap, 0.98), np.quantile(np.abs(distance), 0.98)]
    np.testing.assert_allclose(found.error_p98_m, max(both))
    np.testing.assert_allclose(found.error_max_m, max(np.abs(distance).max(), gap.max()))
    np.testing.assert_allclose(found.error_mean_m, max(np.abs(distance).mean(), gap.mean()))
    np.testing.assert_allclose(found.occupied_recall, (octree.states_at(truth.seen_surface) == 2).mean())
    np.testing.assert_allclose(found.free_recall, (octree.states_at(truth.seen_free) == 1).mean())


def test_points_of_a_scenes_truth_lie_where_they_should() -> None:
    part = small_part(2)
    assert part.scene is not None
    truth = SceneTruth(part.scene, part.scans, 0.05)
    assert np.abs(part.scene.signed_distance(truth.seen_surface)).max() < 1e-9
    assert part.scene.signed_distance(truth.seen_free).min() > 0


def test_a_map_is_perfect_against_itself(octree: OccupancyMap) -> None:
    found = map_accuracy(octree.snapshot(), MapTruth(octree.snapshot()))
    assert found is not None
    assert (found.occupied_precision, found.occupied_recall, found.free_recall) == (1.0, 1.0, 1.0)
    assert found.error_max_m < 1e-9


def test_a_coarser_map_is_less_accurate_against_a_finer_one() -> None:
    part = small_part(1)
    truth = MapTruth(build_map(part.scans, MapSettings(0.05)).occupancy_map.snapshot())
    errors = []
    for resolution_m in (0.1, 0.2, 0.4):
        found = map_accuracy(build_map(part.scans, MapSettings(resolution_m)).occupancy_map.snapshot(), truth)
        assert found is not None
        errors.append(found.error_p95_m)
    assert errors == sorted(errors)


def test_no_point_of_a_surface_is_farther_from_a_sample_than_promised() -> None:
    mesh = box_mesh((0.5, 0.02, 0.3))
    samples = surface_samples(mesh, 0.04)
    rng = np.random.default_rng(5)
    corners = mesh.vertices[mesh.triangles[rng.integers(len(mesh.triangles), size=4000)]]
    points = np.einsum("nc,ncx->nx", rng.dirichlet(np.ones(3), 4000), corners)
    assert all_distances(points, samples).max() <= 0.04
    assert len(samples) < 3000


def test_a_robots_truth_is_that_of_solids() -> None:
    scene = Scene([Box.between((-5, -5, -1), (5, 5, 0)), Sphere.at(2.0, 0.0, 0.5, 0.05)])
    truth = SceneTruth(scene, small_part(1).scans, 0.02)
    robot = Robot("box", [Link("body", (LinkGeometry("mesh", box_mesh((0.4, 0.4, 0.4))),))], [])
    heights = {0.15: ROBOT_COLLIDES, 0.21: ROBOT_UNDECIDED, 0.3: ROBOT_FREE}
    T = np.tile(np.eye(4), (len(heights) + 2, 1, 1))
    T[: len(heights), 2, 3] = list(heights)
    T[-2, :3, 3] = (2.0, 0.0, 0.5)  # the sphere is wholly inside of the robot
    T[-1, :3, 3] = (2.4, 0.0, 0.5)
    states = truth.robot_states(robot, np.zeros((len(T), 0)), T)
    assert states.tolist() == [*heights.values(), ROBOT_COLLIDES, ROBOT_FREE]


def test_a_robot_of_less_detail_misses_no_collision_that_the_full_one_finds(octree: OccupancyMap) -> None:
    part = small_part(1)
    assert part.scene is not None
    truth = SceneTruth(part.scene, part.scans, 0.1)
    robot = Robot("box", [Link("body", (LinkGeometry("mesh", box_mesh((0.5, 0.4, 0.6))),))], [])
    probe = robot_probe(robot, truth, count=60)
    full = probe.figures(octree.snapshot(), "free")
    less = probe.figures(octree.snapshot(), "free", with_detail(robot, 0.02))
    assert less.false_free <= full.false_free
    unknown = probe.figures(octree.snapshot(), "occupied")
    assert unknown.false_free <= full.false_free
    assert unknown.lost_free >= full.lost_free == full.false_collision
