"""Pose files: TUM rows (t x y z qx qy qz qw) and KITTI rows (3x4, row-major), told apart by their number of columns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ScanFormatError

_TUM_COLUMNS, _KITTI_COLUMNS, _MATRIX_COLUMNS = 8, 12, 16
_ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class PoseFile:
    """T_map_sensor: (n,4,4) float64. stamps_s: (n,) float64 seconds of a TUM file, else None."""

    T_map_sensor: NDArray[np.float64]
    stamps_s: NDArray[np.float64] | None

    def __len__(self) -> int:
        return int(self.T_map_sensor.shape[0])


def read_poses(path: Path) -> PoseFile:
    """Poses of a TUM file (8 numbers per row), a KITTI file (12) or rows of whole 4x4 matrices (16).

    Blank lines and lines that start with # are skipped. Rotations rounded by text are made exactly rigid; a row farther
    than 1e-3 from a rotation, a NaN or a row of another length raises ScanFormatError naming the line.
    """
    rows, lines = _read_rows(path)
    columns = rows.shape[1]
    if columns == _TUM_COLUMNS:
        rotation, translation, stamps = _rotations_from_quaternions(rows[:, 4:8], path, lines), rows[:, 1:4], rows[:, 0]
        return PoseFile(_assemble(rotation, translation), stamps)
    matrix = rows.reshape(-1, columns // 4, 4)
    if columns == _MATRIX_COLUMNS:
        wrong = np.flatnonzero(np.abs(matrix[:, 3] - (0.0, 0.0, 0.0, 1.0)).max(axis=1) > _ROTATION_TOLERANCE)
        if wrong.size:
            raise ScanFormatError(f"{path}:{lines[wrong[0]]}: the last row of a pose must be 0 0 0 1")
    return PoseFile(_assemble(_nearest_rotations(matrix[:, :3, :3], path, lines), matrix[:, :3, 3]), None)


def _read_rows(path: Path) -> tuple[NDArray[np.float64], list[int]]:
    rows: list[list[float]] = []
    lines: list[int] = []
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ScanFormatError(f"{path}: not a text file of poses") from error
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            values = [float(word) for word in words]
        except ValueError as error:
            raise ScanFormatError(f"{path}:{number}: not a row of numbers") from error
        if len(values) not in (_TUM_COLUMNS, _KITTI_COLUMNS, _MATRIX_COLUMNS) or (rows and len(values) != len(rows[0])):
            raise ScanFormatError(
                f"{path}:{number}: {len(values)} numbers; a pose has 8 (TUM: t x y z qx qy qz qw), 12 (KITTI 3x4) or 16"
            )
        if not np.isfinite(values).all():
            raise ScanFormatError(f"{path}:{number}: a pose with NaN or infinity")
        rows.append(values)
        lines.append(number)
    if not rows:
        raise ScanFormatError(f"{path}: no poses in it")
    return np.array(rows, dtype=np.float64), lines


def _rotations_from_quaternions(xyzw: NDArray[np.float64], path: Path, lines: list[int]) -> NDArray[np.float64]:
    norm = np.linalg.norm(xyzw, axis=1)
    wrong = np.flatnonzero(np.abs(norm - 1.0) > _ROTATION_TOLERANCE)
    if wrong.size:
        index = wrong[0]
        raise ScanFormatError(f"{path}:{lines[index]}: a quaternion of length {norm[index]:.6g}, expected 1")
    x, y, z, w = (xyzw / norm[:, None]).T
    flat = np.stack(
        [
            1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
        ],
        axis=1,
    )  # fmt: skip
    rotations: NDArray[np.float64] = flat.reshape(-1, 3, 3)
    return rotations


def _nearest_rotations(matrix: NDArray[np.float64], path: Path, lines: list[int]) -> NDArray[np.float64]:
    u, _, vt = np.linalg.svd(matrix)
    rotation: NDArray[np.float64] = u @ vt
    off = np.abs(rotation - matrix).max(axis=(1, 2))
    wrong = np.flatnonzero((off > _ROTATION_TOLERANCE) | (np.linalg.det(rotation) < 0.0))
    if wrong.size:
        raise ScanFormatError(f"{path}:{lines[wrong[0]]}: its 3x3 part is not a rotation")
    return rotation


def _assemble(rotation: NDArray[np.float64], translation: NDArray[np.float64]) -> NDArray[np.float64]:
    poses = np.tile(np.eye(4), (rotation.shape[0], 1, 1))
    poses[:, :3, :3] = rotation
    poses[:, :3, 3] = translation
    return poses
