"""A tuning input that is measured in no time: small sensors on simulated floors."""

from __future__ import annotations

from dataclasses import replace

from rayvox.simulation import DepthCamera, Intrinsics, SpinningLidar, random_floor_run
from rayvox.tune import Part, PosedScan, TuningInput

CAMERA = DepthCamera(Intrinsics(width=48, height=36, fx=30.0, fy=30.0, cx=23.5, cy=17.5))
LIDAR = SpinningLidar(rings=12, columns=96, max_range_m=8.0)


def small_part(seed: int, stations: int = 3, with_truth: bool = True) -> Part:
    run = replace(random_floor_run(seed, stations), camera=CAMERA, lidar=LIDAR)

    def scans() -> tuple[PosedScan, ...]:
        return tuple(PosedScan(s.points, s.T_map_sensor, s.no_return, s.max_range_m) for s in run.scans())

    return Part(f"floor {seed}", scans, (lambda: run.scene) if with_truth else None)


def small_input(parts: int = 3, with_truth: bool = True) -> TuningInput:
    return TuningInput(
        tuple(small_part(seed, with_truth=with_truth) for seed in range(1, parts + 1)), f"small {with_truth}"
    )
