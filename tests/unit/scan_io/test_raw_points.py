"""Scans from .npy and raw .bin files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rayvox.errors import RayvoxError, ScanFormatError
from rayvox.scan_io import read_points

ROWS = np.random.default_rng(0).normal(size=(12, 3)).astype(np.float32)


def test_an_npy_array_comes_back_exactly(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", ROWS)
    loaded = read_points(tmp_path / "scan.npy")
    assert loaded.points.dtype == np.float32
    assert loaded.points.tobytes() == ROWS.tobytes()
    assert loaded.dropped == 0


def test_further_columns_are_ignored(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.column_stack([ROWS, np.ones(12, dtype=np.float32)]))
    assert read_points(tmp_path / "scan.npy").points.tobytes() == ROWS.tobytes()


def test_float64_stays_where_float32_would_change_it(tmp_path: Path) -> None:
    np.save(tmp_path / "wide.npy", np.array([[500000.123, 1.0, 2.0]]))
    np.save(tmp_path / "narrow.npy", ROWS.astype(np.float64))
    assert read_points(tmp_path / "wide.npy").points.dtype == np.float64
    assert read_points(tmp_path / "narrow.npy").points.dtype == np.float32


def test_missing_returns_are_dropped_and_counted(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[2], rows[5, 1], rows[7] = np.nan, np.inf, 0.0
    np.save(tmp_path / "scan.npy", rows)
    loaded = read_points(tmp_path / "scan.npy")
    assert loaded.dropped == 3
    np.testing.assert_array_equal(loaded.points, np.delete(ROWS, [2, 5, 7], axis=0))


def test_a_kitti_bin_has_four_columns_unless_told_otherwise(tmp_path: Path) -> None:
    np.column_stack([ROWS, np.ones(12, dtype=np.float32)]).astype("<f4").tofile(tmp_path / "kitti.bin")
    ROWS.astype("<f4").tofile(tmp_path / "xyz.bin")
    assert read_points(tmp_path / "kitti.bin").points.tobytes() == ROWS.tobytes()
    assert read_points(tmp_path / "xyz.bin", bin_columns=3).points.tobytes() == ROWS.tobytes()


def test_a_bin_of_three_columns_read_as_four_names_the_way_out(tmp_path: Path) -> None:
    ROWS[:11].astype("<f4").tofile(tmp_path / "xyz.bin")
    with pytest.raises(ScanFormatError, match=r"132 bytes are not rows of 4 float32 \(it would fit 3 columns"):
        read_points(tmp_path / "xyz.bin")


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("empty.bin", b"", "0 bytes are not rows"),
        ("torn.npy", b"\x93NUMPY\x01\x00v\x00", "not a readable .npy"),
        ("text.npy", b"hello", "not a readable .npy"),
        ("scan.xyz", b"1 2 3", "unknown kind of scan"),
    ],
)
def test_a_file_that_is_no_scan_is_a_typed_error(tmp_path: Path, name: str, content: bytes, complaint: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ScanFormatError, match=complaint) as caught:
        read_points(tmp_path / name)
    assert isinstance(caught.value, RayvoxError)
    assert isinstance(caught.value, ValueError)
    assert name in str(caught.value)


@pytest.mark.parametrize(
    "array",
    [np.zeros((4, 3)), np.full((4, 3), np.nan), np.ones((4, 2)), np.ones(6), np.array([["a", "b", "c"]])],
    ids=["all zero", "all NaN", "two columns", "flat", "text"],
)
def test_an_array_without_points_is_a_typed_error(tmp_path: Path, array: np.ndarray) -> None:
    np.save(tmp_path / "scan.npy", array)
    with pytest.raises(ScanFormatError, match=r"scan\.npy"):
        read_points(tmp_path / "scan.npy")


def test_a_pickled_array_is_refused_unread(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.array([{"x": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(ScanFormatError):
        read_points(tmp_path / "scan.npy")
