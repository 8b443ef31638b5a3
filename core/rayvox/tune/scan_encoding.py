"""Forms in which a scan's points are sent: bytes, time, and what rounding takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from rayvox.tune.machine_speed import clock_s
from rayvox.tune.scan_input import PosedScan

_UNIT_M = 0.001
ENCODINGS = ("float32", "float32, zstd", "int16 mm", "int16 mm, zstd")


@dataclass(frozen=True, slots=True)
class EncodingFigures:
    """Medians over scans: bytes_per_scan of the points' payload, encode_s; rounding_m: largest change of a coordinate,
    nan where a coordinate is beyond what the form can hold."""

    bytes_per_scan: float
    encode_s: float
    rounding_m: float


def measure_encoding(scans: Sequence[PosedScan], encoding: str) -> EncodingFigures:
    """`encoding` is one of ENCODINGS, which are those of the client's frames."""
    sizes, seconds, rounding = [], [], []
    for scan in scans:
        started = clock_s()
        payload, error_m = _encode(scan.points.astype(np.float32), encoding)
        seconds.append(clock_s() - started)
        sizes.append(len(payload))
        rounding.append(error_m)
    return EncodingFigures(median(sizes), median(seconds), float(np.max(rounding)))


def _encode(points: np.ndarray[tuple[int, ...], np.dtype[np.float32]], encoding: str) -> tuple[bytes, float]:
    payload, error_m = points.tobytes(), 0.0
    if encoding.startswith("int16"):
        units = np.round(points.astype(np.float64) / _UNIT_M)
        holds = np.abs(units).max() <= np.iinfo(np.int16).max
        payload = units.astype(np.int32).astype(np.int16).tobytes()
        error_m = float(np.abs(units * _UNIT_M - points).max()) if holds else float("nan")
    if encoding.endswith("zstd"):
        import zstandard

        payload = zstandard.ZstdCompressor().compress(payload)
    return payload, error_m
