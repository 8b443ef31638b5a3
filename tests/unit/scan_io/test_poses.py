"""Pose files, and how scans find their poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rayvox.errors import ScanFormatError
from rayvox.scan_io import Recording, list_scan_files, match_poses, read_poses
from rayvox.simulation import rigid_transform, rotation_from_rpy

POSES = [
    rigid_transform(rotation_from_rpy(0.1 * n, -0.2 * n, 1.3 * n), np.array([1.0 * n, 500000.25, -3.5]))
    for n in range(12)
]


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).write_bytes(b"")


def test_kitti_rows_come_back_exactly_rigid(tmp_path: Path) -> None:
    rows = [" ".join(f"{value:.7e}" for value in pose[:3].ravel()) for pose in POSES]
    (tmp_path / "poses.txt").write_text("\n".join(rows) + "\n")
    poses = read_poses(tmp_path / "poses.txt")
    assert poses.stamps_s is None
    np.testing.assert_allclose(poses.T_map_sensor, np.stack(POSES), atol=1e-6, rtol=1e-7)
    rotations = poses.T_map_sensor[:, :3, :3]
    np.testing.assert_allclose(rotations @ rotations.transpose(0, 2, 1), np.tile(np.eye(3), (12, 1, 1)), atol=1e-14)


def test_whole_matrices_are_read_too(tmp_path: Path) -> None:
    rows = [" ".join(f"{value!r}" for value in pose.ravel().tolist()) for pose in POSES]
    (tmp_path / "poses.txt").write_text("\n".join(rows))
    np.testing.assert_allclose(read_poses(tmp_path / "poses.txt").T_map_sensor, np.stack(POSES), atol=1e-12)


def test_a_tum_row_is_a_quarter_turn_about_z(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    (tmp_path / "tum.txt").write_text(f"# t x y z qx qy qz qw\n\n12.5 1 2 3 0 0 {half} {half}\n")
    poses = read_poses(tmp_path / "tum.txt")
    assert poses.stamps_s is not None
    assert poses.stamps_s.tolist() == [12.5]
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(poses.T_map_sensor[0], expected, atol=1e-15)


def test_a_recording_is_read_back_with_its_poses_and_times(tmp_path: Path) -> None:
    with Recording(tmp_path) as recording:
        for number, pose in enumerate(POSES):
            recording.write(np.full((2, 3), number + 1, dtype=np.float32), pose, 0.25 * number)
    matched = match_poses(list_scan_files(tmp_path), read_poses(tmp_path / "poses.txt"))
    assert [item.stamp_s for item in matched] == [0.25 * number for number in range(12)]
    for number, item in enumerate(matched):
        np.testing.assert_allclose(item.T_map_sensor, POSES[number], atol=1e-12)
        assert np.load(item.path)[0, 0] == number + 1


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "no poses"),
        ("# only a comment\n", "no poses"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n1 2 3\n", ":2: 3 numbers"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n0 0 0 0 0 0 0 1\n", ":2: 8 numbers"),
        ("1 0 0 nan 0 1 0 0 0 0 1 0\n", ":1: a pose with NaN"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n", ":1: its 3x3 part is not a rotation"),
        ("2 0 0 0 0 2 0 0 0 0 2 0\n", ":1: its 3x3 part is not a rotation"),
        ("0 1 2 3 0 0 0 0.5\n", ":1: a quaternion of length 0.5"),
        ("time x y z qx qy qz qw\n", ":1: not a row of numbers"),
        ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2\n", ":1: the last row"),
    ],
)
def test_a_bad_pose_file_names_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "poses.txt").write_text(text)
    with pytest.raises(ScanFormatError, match=complaint):
        read_poses(tmp_path / "poses.txt")


def test_scans_are_ordered_by_number_not_by_letter(tmp_path: Path) -> None:
    touch(tmp_path, "scan10.npy", "scan2.npy", "scan1.npy", "poses.txt")
    assert [file.name for file in list_scan_files(tmp_path)] == ["scan1.npy", "scan2.npy", "scan10.npy"]


def test_scans_named_by_time_take_the_nearest_pose_within_the_tolerance(tmp_path: Path) -> None:
    touch(tmp_path, "100.00.npy", "100.52.npy", "109.00.npy")
    (tmp_path / "tum.txt").write_text("".join(f"{100 + n / 2} {n} 0 0 0 0 0 1\n" for n in range(9)))
    matched = match_poses(list_scan_files(tmp_path), read_poses(tmp_path / "tum.txt"))
    assert [(item.path.name, item.T_map_sensor[0, 3]) for item in matched] == [("100.00.npy", 0.0), ("100.52.npy", 1.0)]


def test_counts_that_do_not_fit_are_refused_with_both_counts(tmp_path: Path) -> None:
    touch(tmp_path, "a.npy", "b.npy", "c.npy")
    (tmp_path / "kitti.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (tmp_path / "tum.txt").write_text("0 1 2 3 0 0 0 1\n")
    for name in ("kitti.txt", "tum.txt"):
        with pytest.raises(ScanFormatError, match="3 scans but 1 poses"):
            match_poses(list_scan_files(tmp_path), read_poses(tmp_path / name))


def test_a_folder_without_scans_or_with_two_kinds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScanFormatError, match="no scans in it"):
        list_scan_files(tmp_path)
    with pytest.raises(ScanFormatError, match="no such folder"):
        list_scan_files(tmp_path / "absent")
    touch(tmp_path, "a.npy", "b.pcd")
    with pytest.raises(ScanFormatError, match="several kinds"):
        list_scan_files(tmp_path)
