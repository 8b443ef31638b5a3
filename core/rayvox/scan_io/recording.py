"""Scans written as a folder of .npy files and a TUM pose file, as `rayvox upload` reads them."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

POSE_FILE_NAME = "poses.txt"


class Recording:
    """Writes scans one by one: `000000.npy`, `000001.npy`, ... and their poses to `poses.txt`; a context manager."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.count = 0
        self._poses: TextIO = (self.folder / POSE_FILE_NAME).open("w", encoding="ascii")
        self._poses.write("# t x y z qx qy qz qw\n")

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the pose file."""
        self._poses.close()

    def write(self, points: ArrayLike, T_map_sensor: NDArray[np.float64], stamp_s: float) -> None:
        """Add a scan: points (n,3) metres in the sensor frame, its rigid pose (4,4) float64 and its time."""
        np.save(self.folder / f"{self.count:06d}.npy", np.asarray(points))
        values = [stamp_s, *T_map_sensor[:3, 3], *_quaternion(T_map_sensor[:3, :3])]
        self._poses.write(" ".join(f"{value:.17g}" for value in values) + "\n")
        self.count += 1


def _quaternion(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit quaternion (x, y, z, w) of a rotation (3,3): the eigenvector of Bar-Itzhack's symmetric matrix."""
    r = rotation
    symmetric = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    _, vectors = np.linalg.eigh(symmetric)
    quaternion: NDArray[np.float64] = vectors[:, -1]
    return quaternion if quaternion[3] >= 0.0 else -quaternion
