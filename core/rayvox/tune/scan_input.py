"""What settings are tuned on: scans with poses, in parts that are measured each by itself.

The spread between the parts is what a prediction for scans that were not there is made of (prediction.py), so a part
is a scene of its own where the simulator makes them, and a stretch of the sequence where scans were recorded.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError
from rayvox.scan_io import PosedFile
from rayvox.simulation import Scene, random_floor_run

MOST_PARTS = 6
_LEAST_SCANS_PER_PART = 2


@dataclass(frozen=True, eq=False)
class PosedScan:
    """points (n,3) metres, sensor frame; T_map_sensor (4,4) float64; no_return (k,3) or None; max_range_m or None."""

    points: npt.NDArray[np.float32] | npt.NDArray[np.float64]
    T_map_sensor: npt.NDArray[np.float64]
    no_return: npt.NDArray[np.float32] | None = None
    max_range_m: float | None = None


@dataclass(frozen=True, eq=False)
class Part:
    """Scans of one scene; both are made when they are first needed. make_scene: None where the truth is not known."""

    name: str
    load: Callable[[], tuple[PosedScan, ...]]
    make_scene: Callable[[], Scene] | None = None

    @cached_property
    def scans(self) -> tuple[PosedScan, ...]:
        return self.load()

    @cached_property
    def scene(self) -> Scene | None:
        """The true geometry, if it is known."""
        return self.make_scene() if self.make_scene is not None else None


@dataclass(frozen=True)
class TuningInput:
    """parts: each measured by itself. fingerprint: the same for the same scans, so that results can be taken up."""

    parts: tuple[Part, ...]
    fingerprint: str


def simulated(seeds: Sequence[int], stations: int = 12) -> TuningInput:
    """One part per seed: a random floor, seen from `stations` places by a depth camera, and some by a lidar."""
    if not seeds or stations < 1:
        raise InvalidInputError("at least one seed and one station are needed")
    return TuningInput(tuple(_floor(seed, stations) for seed in seeds), f"simulated {list(seeds)} {stations}")


def recorded(files: Sequence[PosedFile], read: Callable[[PosedFile], PosedScan], reading: str = "") -> TuningInput:
    """Stretches of a recorded sequence, up to six, of at least two scans each if there are so many.

    reading: names how `read` reads; results of files read otherwise are not taken up.
    """
    if not files:
        raise InvalidInputError("there is no scan to tune on")
    count = min(MOST_PARTS, max(1, len(files) // _LEAST_SCANS_PER_PART))
    stretches = [list(stretch) for stretch in np.array_split(np.arange(len(files)), count)]
    return TuningInput(
        tuple(_stretch([files[i] for i in chosen], int(chosen[0]), read) for chosen in stretches),
        f"{_fingerprint(files)} {reading}",
    )


def _floor(seed: int, stations: int) -> Part:
    def scans() -> tuple[PosedScan, ...]:
        return tuple(
            PosedScan(scan.points, scan.T_map_sensor, scan.no_return, scan.max_range_m)
            for scan in random_floor_run(seed, stations).scans()
        )

    return Part(f"floor {seed}", scans, lambda: random_floor_run(seed, stations).scene)


def _stretch(files: Sequence[PosedFile], first: int, read: Callable[[PosedFile], PosedScan]) -> Part:
    return Part(f"scans {first} to {first + len(files) - 1}", lambda: tuple(read(file) for file in files))


def _fingerprint(files: Sequence[PosedFile]) -> str:
    digest = hashlib.sha256()
    for file in files:
        status = file.path.stat()
        digest.update(f"{file.path.name} {status.st_size} {status.st_mtime_ns}".encode())
        digest.update(file.T_map_sensor.tobytes())
    return f"recorded {digest.hexdigest()[:24]}"
