"""Scans: what a robot sends."""

from __future__ import annotations

import uuid
from abc import ABC, abstractmethod
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rayvox_client import validation
from rayvox_client.errors import InvalidInputError
from rayvox_client.frame import Compression, OutgoingFrame, lay_out_frame
from rayvox_client.intrinsics import Intrinsics
from rayvox_client.self_filter import SelfFilter


class PosedOptions(TypedDict, total=False):
    """Keyword arguments that every scan takes; `PosedScan` says what they mean."""

    origin: ArrayLike
    max_range_m: float | None
    no_return: ArrayLike | None
    discretize: bool
    scan_id: str | uuid.UUID | None
    stamp_s: float | None
    self_filter: SelfFilter | None


class ScanOptions(PosedOptions, total=False):
    """Keyword arguments of `Scan`."""

    scale_m: float | None


class PosedScan(ABC):
    """What point scans and depth images share. Do not change a scan's arrays before it is acknowledged.

    Attributes:
        T_map_sensor: (4,4) float64 rigid transform, map point = T_map_sensor * sensor point.
        origin: beam origin in the sensor frame, metres.
        max_range_m: longer rays are cut there and mark no end point; None for no limit.
        no_return: (k,3) direction times range of beams that met nothing, sensor frame, metres: they only clear.
        discretize: one ray per end-point voxel, as OctoMap's `discretize`.
        stamp_s: the sender's time, kept by the service, not interpreted.
        scan_id: UUID; sending the same scan again under it is harmless.
        self_filter: the robot that carries the sensor, to be left out of the map.
    """

    __slots__ = (
        "T_map_sensor", "discretize", "max_range_m", "no_return", "origin", "scan_id", "self_filter", "stamp_s"
    )  # fmt: skip

    def __init__(
        self,
        T_map_sensor: ArrayLike | None = None,
        *,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        max_range_m: float | None = None,
        no_return: ArrayLike | None = None,
        discretize: bool = False,
        scan_id: str | uuid.UUID | None = None,
        stamp_s: float | None = None,
        self_filter: SelfFilter | None = None,
    ) -> None:
        self.T_map_sensor = validation.rigid_transform(T_map_sensor, "T_map_sensor")
        self.origin = validation.vector3(origin, "origin")
        self.max_range_m = validation.positive_number(max_range_m, "max_range_m")
        self.no_return: NDArray[Any] | None = None
        if no_return is not None:
            self.no_return = validation.points_array(no_return, "no_return", allow_empty=True)
        self.discretize = bool(discretize)
        self.scan_id = validation.scan_id_text(scan_id)
        self.stamp_s = None if stamp_s is None else float(stamp_s)
        if self.stamp_s is not None and not np.isfinite(self.stamp_s):
            raise InvalidInputError(f"stamp_s = {stamp_s!r} is not finite")
        self.self_filter = self_filter

    @property
    @abstractmethod
    def point_count(self) -> int:
        """Points (or depth pixels) in the scan."""

    @abstractmethod
    def _measured(self) -> tuple[dict[str, object], dict[str, NDArray[Any]]]:
        """Header fields and payloads of the measurement itself."""

    def to_frame(self, compression: Compression = None) -> bytes:
        """The scan as one binary frame; the arrays are copied once, into it."""
        return self.lay_out_frame(compression).to_bytes()

    def lay_out_frame(self, compression: Compression = None) -> OutgoingFrame:
        """The scan as a frame that refers to the scan's own arrays, for sending."""
        fields: dict[str, object] = {
            "scan_id": self.scan_id,
            "T_map_sensor": self.T_map_sensor.ravel().tolist(),
            "origin": self.origin,
            "max_range_m": self.max_range_m,
            "discretize": self.discretize,
            "stamp_s": self.stamp_s,
        }
        if self.self_filter is not None:
            fields["self_filter"] = self.self_filter.to_json()
        measured_fields, payloads = self._measured()
        if self.no_return is not None and len(self.no_return):
            payloads["no_return"] = self.no_return
        return lay_out_frame("scan", fields | measured_fields, payloads, compression)

    def __repr__(self) -> str:
        position = ", ".join(f"{x:.3f}" for x in self.T_map_sensor[:3, 3])
        return f"{type(self).__name__}({self.point_count:,} points from ({position}) m, scan_id={self.scan_id!r})"


class Scan(PosedScan):
    """Points measured from one pose.

    Args:
        points: (n,3) float32 or float64, sensor frame, metres; or int16 together with `scale_m`. Other numbers are
            sent as float64. May be (0,3) where `no_return` has rows.
        T_map_sensor: (4,4) rigid transform from the sensor to the map frame; None for identity.
        scale_m: metres per unit of int16 points.
        Others: see `PosedScan`.

    Raises:
        InvalidInputError: wrong shape, not finite, not rigid, or empty; the message names the index and the value.
    """

    __slots__ = ("points", "scale_m")

    def __init__(
        self,
        points: ArrayLike,
        T_map_sensor: ArrayLike | None = None,
        *,
        scale_m: float | None = None,
        **options: Unpack[PosedOptions],
    ) -> None:
        super().__init__(T_map_sensor, **options)
        self.scale_m = validation.positive_number(scale_m, "scale_m")
        only_clears = self.no_return is not None and len(self.no_return) > 0
        if self.scale_m is None:
            if isinstance(points, np.ndarray) and points.dtype == np.int16:
                raise InvalidInputError("int16 points need scale_m, the metres per unit")
            self.points = validation.points_array(points, "points", allow_empty=only_clears)
        else:
            self.points = self._integer_points(points, only_clears)

    @staticmethod
    def _integer_points(points: ArrayLike, allow_empty: bool) -> NDArray[Any]:
        array = np.asarray(points)
        if array.dtype != np.int16 or array.ndim != 2 or array.shape[1] != 3:
            raise InvalidInputError(f"scale_m goes with int16 points (n, 3), got {array.dtype} {array.shape}")
        if not allow_empty and array.shape[0] == 0:
            raise InvalidInputError("points is empty: shape (0, 3)")
        return array

    @property
    def point_count(self) -> int:
        return len(self.points)

    def _measured(self) -> tuple[dict[str, object], dict[str, NDArray[Any]]]:
        return ({} if self.scale_m is None else {"scale_m": self.scale_m}), {"points": self.points}


class DepthScan(PosedScan):
    """A depth image taken from one pose.

    Args:
        depth: (rows, columns) uint16, 0 meaning no measurement.
        intrinsics: the camera; `depth_scale_m` gives the metres per unit.
        T_map_sensor: (4,4) rigid transform from the camera's optical frame (z forward) to the map frame.
        Others: see `PosedScan`.

    Raises:
        InvalidInputError: wrong dtype or shape, no pixel at all, or a pose that is not rigid.
    """

    __slots__ = ("depth", "intrinsics")

    def __init__(
        self,
        depth: ArrayLike,
        intrinsics: Intrinsics,
        T_map_sensor: ArrayLike | None = None,
        **options: Unpack[PosedOptions],
    ) -> None:
        super().__init__(T_map_sensor, **options)
        image = np.asarray(depth)
        if image.dtype != np.uint16 or image.ndim != 2:
            raise InvalidInputError(f"depth must be uint16 (rows, columns), got {image.dtype} {image.shape}")
        if image.size == 0:
            raise InvalidInputError(f"depth is empty: shape {image.shape}")
        self.depth = image
        self.intrinsics = intrinsics

    @property
    def point_count(self) -> int:
        return int(self.depth.size)

    def _measured(self) -> tuple[dict[str, object], dict[str, NDArray[Any]]]:
        return {"intrinsics": self.intrinsics.to_json()}, {"depth": self.depth}
