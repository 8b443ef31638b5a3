"""The simulated run."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
from rayvox.simulation import T_BASE_CAMERA, DepthCamera, Intrinsics, RobotRun, SpinningLidar, robot_boxes, robot_poses

SMALL_CAMERA = DepthCamera(Intrinsics(width=40, height=30, fx=33.0, fy=33.0, cx=19.5, cy=14.5))
SMALL_LIDAR = SpinningLidar(rings=8, columns=64)


def small_run(seed: int = 1) -> RobotRun:
    return RobotRun(stations=6, lidar_every=3, seed=seed, camera=SMALL_CAMERA, lidar=SMALL_LIDAR)


def test_the_same_seed_gives_the_same_scans_bit_for_bit() -> None:
    first, second = list(small_run().scans()), list(small_run().scans())
    assert len(first) == len(small_run()) == 8
    for one, other in zip(first, second, strict=True):
        assert one.points.tobytes() == other.points.tobytes()
        assert one.no_return.tobytes() == other.no_return.tobytes()
        assert one.T_map_sensor.tobytes() == other.T_map_sensor.tobytes()


def test_another_seed_gives_other_noise() -> None:
    first, second = next(small_run(1).scans()), next(small_run(2).scans())
    assert first.points.tobytes() != second.points.tobytes()


def test_scans_come_in_the_order_of_time_with_both_sensors() -> None:
    scans = list(small_run().scans())
    stamps = [scan.stamp_s for scan in scans]
    assert stamps == sorted(stamps)
    assert [scan.sensor for scan in scans].count("spinning_lidar") == 2


def test_every_pose_is_rigid_and_on_the_floor() -> None:
    poses = robot_poses(100)
    eye = np.broadcast_to(np.eye(3), (100, 3, 3))
    np.testing.assert_allclose(poses[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1), eye, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(poses[:, :3, :3]), 1.0)
    assert (poses[:, 2, 3] == 0.0).all()


def test_the_camera_looks_where_the_robot_drives_and_slightly_down() -> None:
    forward = T_BASE_CAMERA[:3, 2]
    assert forward[0] > 0.95
    assert -0.25 < forward[2] < -0.1
    assert abs(forward[1]) < 1e-12


def test_robot_boxes_hold_the_turned_robot() -> None:
    poses = robot_poses(50)
    lo, hi = robot_boxes(poses)
    corners = np.array([[x, y, 0.45, 1.0] for x in (-0.3, 0.3) for y in (-0.25, 0.25)])
    in_map = np.einsum("nij,kj->nki", poses, corners)[..., :3]
    assert (in_map >= lo[:, None] - 1e-9).all()
    assert (in_map <= hi[:, None] + 1e-9).all()


def test_the_simulation_imports_nothing_but_numpy() -> None:
    code = (
        "import sys, importlib.util, types; package = types.ModuleType('rayvox'); "
        f"package.__path__ = [{str(next(iter(_package_folder())))!r}]; sys.modules['rayvox'] = package; "
        "before = set(sys.modules); import rayvox.simulation; "
        "tops = {name.partition('.')[0] for name in set(sys.modules) - before}; "
        "print(sorted(tops - set(sys.stdlib_module_names) - {'rayvox', 'numpy'}))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert [name for name in eval(result.stdout) if "editable" not in name and not name.startswith("_")] == []


def _package_folder() -> list[str]:
    import rayvox.simulation

    return [path.removesuffix("/simulation") for path in rayvox.simulation.__path__]
