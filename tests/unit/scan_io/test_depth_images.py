"""16-bit depth images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rayvox.errors import InvalidInputError, ScanFormatError
from rayvox.scan_io import DepthIntrinsics, depth_to_points, read_depth_png, read_points

Image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
LENS = DepthIntrinsics(fx=2.0, fy=4.0, cx=1.0, cy=0.5, depth_scale_m=0.001)
DEPTH = np.array([[0, 1000, 2000], [65535, 0, 40000]], dtype=np.uint16)


def test_a_16_bit_png_comes_back_exactly(tmp_path: Path) -> None:
    Image.fromarray(DEPTH).save(tmp_path / "depth.png")
    image = read_depth_png(tmp_path / "depth.png")
    assert image.dtype == np.uint16
    np.testing.assert_array_equal(image, DEPTH)


def test_each_measured_pixel_becomes_the_point_its_pinhole_says() -> None:
    points = depth_to_points(DEPTH, LENS)
    expected = [[0.0, -0.125, 1.0], [1.0, -0.25, 2.0], [-32.7675, 8.191875, 65.535], [20.0, 5.0, 40.0]]
    np.testing.assert_allclose(points, expected, rtol=1e-6)
    assert points.dtype == np.float32


def test_a_depth_png_is_a_scan_when_its_intrinsics_are_given(tmp_path: Path) -> None:
    Image.fromarray(DEPTH).save(tmp_path / "depth.png")
    np.testing.assert_array_equal(
        read_points(tmp_path / "depth.png", intrinsics=LENS).points, depth_to_points(DEPTH, LENS)
    )
    with pytest.raises(ScanFormatError, match="needs the camera's intrinsics"):
        read_points(tmp_path / "depth.png")


def test_images_that_are_not_16_bit_grey_are_refused(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((4, 4), dtype=np.uint8)).save(tmp_path / "grey8.png")
    Image.fromarray(np.zeros((4, 4, 3), dtype=np.uint8)).save(tmp_path / "colour.png")
    (tmp_path / "torn.png").write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    for name in ("grey8.png", "colour.png", "torn.png"):
        with pytest.raises(ScanFormatError, match=name):
            read_depth_png(tmp_path / name)


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.0, 0.0), (1.0, -1.0, 0.0, 0.0), (1.0, 1.0, np.nan, 0.0)])
def test_impossible_intrinsics_are_refused(values: tuple[float, float, float, float]) -> None:
    with pytest.raises(InvalidInputError, match="intrinsics"):
        DepthIntrinsics(*values)


def test_depth_arrays_of_another_type_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="uint16"):
        depth_to_points(DEPTH.astype(np.float32), LENS)
