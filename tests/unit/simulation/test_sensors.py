"""The simulated depth camera and lidar."""

from __future__ import annotations

import numpy as np
import pytest
from rayvox.scan_io import DepthIntrinsics, depth_to_points
from rayvox.simulation import (
    Box,
    DepthCamera,
    Intrinsics,
    Scene,
    SpinningLidar,
    benchmark_sweeps,
    benchmark_views,
    look_at,
    make_building,
)

WALL_AT_4M = Scene([Box.between((4.0, -50.0, -50.0), (5.0, 50.0, 50.0))])
FACING_X = look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
SMALL = Intrinsics(width=80, height=60, fx=65.0, fy=65.0, cx=39.5, cy=29.5)


def test_a_noiseless_camera_measures_the_z_depth_of_a_wall() -> None:
    camera = DepthCamera(SMALL, noise_floor_m=0.0, noise_growth_per_m=0.0, dropout_rate=0.0)
    capture = camera.capture(WALL_AT_4M, FACING_X, np.random.default_rng(0))
    assert (capture.depth_u16 == 4000).all()
    in_map = capture.scan.points @ FACING_X[:3, :3].T
    np.testing.assert_allclose(in_map[:, 0], 4.0, atol=1e-5)
    assert capture.scan.no_return.shape == (0, 3)


def test_the_left_of_the_image_is_the_left_of_the_scene() -> None:
    left_half = Scene([Box.between((4.0, 0.001, -50.0), (5.0, 50.0, 50.0))])
    depth = DepthCamera(SMALL).true_depth(left_half, FACING_X)
    assert np.isfinite(depth[:, :40]).all()
    assert np.isinf(depth[:, 40:]).all()


def test_the_top_of_the_image_is_the_top_of_the_scene() -> None:
    upper_half = Scene([Box.between((4.0, -50.0, 0.001), (5.0, 50.0, 50.0))])
    depth = DepthCamera(SMALL).true_depth(upper_half, FACING_X)
    assert np.isfinite(depth[:30]).all()
    assert np.isinf(depth[30:]).all()


def test_depth_noise_grows_with_the_square_of_the_distance() -> None:
    def spread(distance: float) -> float:
        wall = Scene([Box.between((distance, -50.0, -50.0), (distance + 1.0, 50.0, 50.0))])
        camera = DepthCamera(dropout_rate=0.0)
        depth = camera.capture(wall, FACING_X, np.random.default_rng(1)).depth_u16
        return float(np.std(depth[depth > 0]) * 0.001)

    assert spread(2.0) == pytest.approx(0.001 + 0.0015 * 4.0, rel=0.05)
    assert spread(6.0) == pytest.approx(0.001 + 0.0015 * 36.0, rel=0.05)


def test_image_and_points_are_the_same_measurement() -> None:
    capture = benchmark_views(DepthCamera(SMALL))["office"]
    lens = capture.intrinsics
    points = depth_to_points(
        capture.depth_u16, DepthIntrinsics(lens.fx, lens.fy, lens.cx, lens.cy, capture.depth_scale_m)
    )
    np.testing.assert_allclose(points, capture.scan.points, atol=1e-6)


@pytest.mark.parametrize("rate", [0.0, 0.2])
def test_lidar_dropouts_take_the_share_they_are_told_to(rate: float) -> None:
    lidar = SpinningLidar(lowest_deg=-10.0, highest_deg=10.0, dropout_rate=rate)
    inside_box = Scene([Box.between((-6.0, -6.0, -9.0), (-5.0, 6.0, 9.0)), *_cage()])
    sweep = lidar.sweep(inside_box, np.eye(4), np.random.default_rng(2))
    assert sweep.points.shape[0] == pytest.approx((1.0 - rate) * 65536, rel=0.01)
    assert sweep.no_return.shape == (0, 3)


def _cage() -> list[Box]:
    return [
        Box.between((5.0, -6.0, -9.0), (6.0, 6.0, 9.0)),
        Box.between((-6.0, -6.0, -9.0), (6.0, -5.0, 9.0)),
        Box.between((-6.0, 5.0, -9.0), (6.0, 6.0, 9.0)),
    ]


def test_rays_that_meet_nothing_are_reported_at_full_range() -> None:
    lidar = SpinningLidar(dropout_rate=0.0)
    sweep = lidar.sweep(WALL_AT_4M, np.eye(4), np.random.default_rng(3))
    np.testing.assert_allclose(np.linalg.norm(sweep.no_return, axis=1), lidar.max_range_m, rtol=1e-6)
    assert (sweep.no_return[:, 0] < 4.0).all()
    assert sweep.points.shape[0] + sweep.no_return.shape[0] == 65536


def test_a_measured_range_never_exceeds_the_sensors_reach() -> None:
    for scan in [*benchmark_sweeps().values(), *(view.scan for view in benchmark_views().values())]:
        assert np.linalg.norm(scan.points, axis=1).max() <= scan.max_range_m * (1 + 1e-6)
        assert scan.points.dtype == scan.no_return.dtype == np.float32
        assert scan.T_map_sensor.dtype == np.float64


def test_measured_points_lie_near_the_buildings_surfaces() -> None:
    scene = make_building()
    for name, sweep in benchmark_sweeps().items():
        in_map = sweep.points[::7] @ sweep.T_map_sensor[:3, :3].T + sweep.T_map_sensor[:3, 3]
        assert np.abs(scene.signed_distance(in_map)).max() < 6 * SpinningLidar().noise_sigma_m, name


def test_the_six_benchmark_views_have_76800_rays_and_see_most_of_their_room() -> None:
    views = benchmark_views()
    assert len(views) == 6
    for name, view in views.items():
        assert view.depth_u16.shape == (240, 320)
        assert view.scan.points.shape[0] > 0.75 * 76800, name
