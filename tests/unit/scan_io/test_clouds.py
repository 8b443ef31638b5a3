"""PCD and PLY files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rayvox.errors import MissingDependencyError, ScanFormatError
from rayvox.scan_io import decode_cloud, read_points

POINTS = np.array([[1.5, -2.25, 0.5], [0.125, 4.0, -1.0], [7.0, 0.0, 2.0]], dtype=np.float32)


def pcd_text(count: int = 3) -> str:
    rows = "\n".join(" ".join(str(float(value)) for value in point) for point in POINTS)
    return (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA ascii\n{rows}\n"
    )


def ply_bytes(count: int = 3) -> bytes:
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    return header.encode() + POINTS.astype("<f4").tobytes()


@pytest.mark.parametrize(("name", "content"), [("scan.pcd", pcd_text().encode()), ("scan.ply", ply_bytes())])
def test_a_cloud_comes_back_exactly(tmp_path: Path, name: str, content: bytes) -> None:
    pytest.importorskip("open3d", reason="open3d is not installed", exc_type=ImportError)
    (tmp_path / name).write_bytes(content)
    loaded = read_points(tmp_path / name)
    assert loaded.points.tobytes() == POINTS.tobytes()
    in_memory = decode_cloud(content, "pcd" if name.endswith("pcd") else "ply")
    assert in_memory.points.tobytes() == POINTS.tobytes()


@pytest.mark.parametrize("write_ascii", [True, False])
@pytest.mark.parametrize("compressed", [True, False])
def test_every_pcd_encoding_is_read_and_its_missing_returns_dropped(
    tmp_path: Path, write_ascii: bool, compressed: bool
) -> None:
    open3d = pytest.importorskip("open3d", reason="open3d is not installed", exc_type=ImportError)
    rows = np.vstack([np.tile(POINTS, (100, 1)), [[np.nan, 1.0, 2.0]]]).astype(np.float64)
    path = str(tmp_path / "scan.pcd")
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(rows))
    assert open3d.io.write_point_cloud(path, cloud, write_ascii=write_ascii, compressed=compressed)
    loaded = read_points(path)
    assert loaded.dropped == 1
    np.testing.assert_array_equal(loaded.points, np.tile(POINTS, (100, 1)))


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("a.pcd", pcd_text(10**9).encode(), "claims 1000000000 points, the limit is"),
        ("b.pcd", pcd_text(10**6).encode(), "claims 1000000 points, at least 6000000 bytes; the file has"),
        ("c.pcd", pcd_text(0).encode(), "claims 0 points"),
        ("d.pcd", pcd_text().replace("FIELDS x y z", "FIELDS a b c").encode(), "without the fields x y z"),
        ("e.pcd", b"garbage", "not a PCD header"),
        ("f.ply", ply_bytes(10**9), "claims 1000000000 points, the limit is"),
        ("g.ply", ply_bytes(10**4), "claims 10000 points, at least 120000 bytes; the file has"),
        ("h.ply", b"\x00" * 300, "not a PLY header"),
        ("i.ply", b"ply\nformat ascii 1.0\nelement face 3\nend_header\n", "without vertices"),
        ("j.ply", b"", "not a PLY header"),
    ],
)
def test_a_header_that_lies_is_refused_before_open3d_sees_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, content: bytes, complaint: str
) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ScanFormatError, match=complaint):
        read_points(tmp_path / name)


def test_without_open3d_the_error_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    (tmp_path / "scan.pcd").write_text(pcd_text())
    with pytest.raises(MissingDependencyError, match="pip install open3d"):
        read_points(tmp_path / "scan.pcd")


def test_reading_other_kinds_imports_neither_open3d_nor_pillow(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", POINTS)
    code = (
        "import sys; from rayvox.scan_io import read_points; "
        f"read_points({str(tmp_path / 'scan.npy')!r}); print(sorted({{'open3d', 'PIL'}} & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
