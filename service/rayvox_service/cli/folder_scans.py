"""A folder's scans as the client sends them."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rayvox.scan_io import PosedFile, read_depth_png, read_points
from rayvox_client import DepthScan, Intrinsics, PosedScan, Scan

from rayvox_service.cli.command_error import CommandError


@dataclass
class FolderScans:
    """Reads one scan after the other; a sized iterable, so that a progress bar knows its end.

    A scan's id is the hash of its file's name and of what is sent, so that an interrupted upload can simply be started
    again; equal scans in two files are two scans.
    dropped: rows without a measurement, left out so far.
    """

    files: list[PosedFile]
    T_pose_sensor: NDArray[np.float64]
    max_range_m: float | None = None
    discretize: bool = False
    bin_columns: int = 4
    intrinsics: tuple[float, float, float, float] | None = None
    depth_scale_m: float = 0.001
    dropped: int = 0

    def __len__(self) -> int:
        return len(self.files)

    def __iter__(self) -> Iterator[PosedScan]:
        for file in self.files:
            yield self._depth_scan(file) if file.path.suffix.lower() == ".png" else self._point_scan(file)

    def _point_scan(self, file: PosedFile) -> PosedScan:
        loaded = read_points(file.path, bin_columns=self.bin_columns)
        self.dropped += loaded.dropped
        pose = file.T_map_sensor @ self.T_pose_sensor
        return Scan(
            loaded.points,
            pose,
            max_range_m=self.max_range_m,
            discretize=self.discretize,
            scan_id=self._scan_id(file, loaded.points.tobytes(), pose),
            stamp_s=file.stamp_s,
        )

    def _depth_scan(self, file: PosedFile) -> PosedScan:
        if self.intrinsics is None:
            raise CommandError("depth images need --intrinsics FX,FY,CX,CY")
        image = read_depth_png(file.path)
        pose = file.T_map_sensor @ self.T_pose_sensor
        lens = Intrinsics(*self.intrinsics, depth_scale_m=self.depth_scale_m)
        return DepthScan(
            image,
            lens,
            pose,
            max_range_m=self.max_range_m,
            discretize=self.discretize,
            scan_id=self._scan_id(file, image.tobytes(), pose),
            stamp_s=file.stamp_s,
        )

    def _scan_id(self, file: PosedFile, measurement: bytes, pose: NDArray[np.float64]) -> uuid.UUID:
        digest = hashlib.sha256(measurement)
        digest.update(pose.tobytes())
        settings = (file.path.name, self.max_range_m, self.discretize, self.intrinsics, self.depth_scale_m)
        digest.update(repr(settings).encode())
        return uuid.UUID(bytes=digest.digest()[:16], version=4)
