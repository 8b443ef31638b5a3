"""A folder of scans as it goes up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rayvox.scan_io import PosedFile
from rayvox_client import DepthScan, Scan
from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.folder_scans import FolderScans

POINTS = np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 0.0], [4.0, 5.0, 6.0]], dtype=np.float32)
POSE = np.array([[0.0, -1.0, 0.0, 7.0], [1.0, 0.0, 0.0, 8.0], [0.0, 0.0, 1.0, 9.0], [0.0, 0.0, 0.0, 1.0]])


def folder(path: Path, *names: str) -> list[PosedFile]:
    for name in names:
        np.save(path / name, POINTS)
    return [PosedFile(path / name, POSE, float(index)) for index, name in enumerate(names)]


def ids(files: list[PosedFile], max_range_m: float | None = None) -> list[str]:
    return [scan.scan_id for scan in FolderScans(files, np.eye(4), max_range_m=max_range_m)]


def test_a_scan_goes_up_with_its_points_pose_and_time(tmp_path: Path) -> None:
    T_pose_sensor = np.eye(4)
    T_pose_sensor[:3, 3] = (0.5, 0.0, 0.0)
    scans = FolderScans(folder(tmp_path, "0.npy", "1.npy"), T_pose_sensor, max_range_m=9.0)
    first, second = list(scans)
    assert isinstance(first, Scan)
    np.testing.assert_array_equal(first.points, POINTS[[0, 2]])
    np.testing.assert_allclose(first.T_map_sensor[:3, 3], [7.0, 8.5, 9.0])
    assert (first.stamp_s, second.stamp_s, first.max_range_m) == (0.0, 1.0, 9.0)
    assert scans.dropped == 2
    assert len(scans) == 2


def test_a_second_upload_sends_the_same_ids(tmp_path: Path) -> None:
    files = folder(tmp_path, "0.npy", "1.npy")
    assert ids(files) == ids(files)


def test_equal_scans_in_two_files_are_two_scans(tmp_path: Path) -> None:
    first, second = ids(folder(tmp_path, "0.npy", "1.npy"))
    assert first != second


def test_other_poses_or_settings_make_another_scan(tmp_path: Path) -> None:
    (file,) = folder(tmp_path, "0.npy")
    moved = PosedFile(file.path, np.eye(4), file.stamp_s)
    assert len({*ids([file]), *ids([moved]), *ids([file], max_range_m=5.0)}) == 3


def test_a_depth_image_goes_up_as_an_image(tmp_path: Path) -> None:
    image_module = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    depth = np.arange(12, dtype=np.uint16).reshape(3, 4) * 1000
    image_module.fromarray(depth).save(tmp_path / "0.png")
    files = [PosedFile(tmp_path / "0.png", POSE, None)]
    (scan,) = FolderScans(files, np.eye(4), intrinsics=(50.0, 51.0, 2.0, 1.5), depth_scale_m=0.0002)
    assert isinstance(scan, DepthScan)
    np.testing.assert_array_equal(scan.depth, depth)
    assert (scan.intrinsics.fy, scan.intrinsics.cx, scan.intrinsics.depth_scale_m) == (51.0, 2.0, 0.0002)
    with pytest.raises(CommandError, match="need --intrinsics"):
        list(FolderScans(files, np.eye(4)))
