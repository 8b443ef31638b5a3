"""Measure what settings cost and lose on your scans, and recommend those that keep an error bound."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rayvox.scan_io import DepthIntrinsics, PosedFile, read_points

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.scan_folder import add_folder_arguments, extrinsic, intrinsics, posed_files

if TYPE_CHECKING:
    from rayvox import Robot
    from rayvox.tune import PosedScan, TuningInput

_UNITS_S = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scans, need, and how long it may take."""
    add_folder_arguments(parser, optional=True)
    parser.add_argument("--simulate", type=int, metavar="N", help="N simulated floors in place of a folder")
    parser.add_argument("--seed", type=int, default=1, help="of the first simulated floor (default %(default)s)")
    parser.add_argument("--stations", type=int, default=12, help="stops on a simulated floor (default %(default)s)")
    parser.add_argument("--max-range", type=float, metavar="M", help="the sensor's: longer rays mark no end point")
    parser.add_argument("--robot", type=Path, help="URDF or mesh file (STL OBJ PLY OFF DAE GLB, metres)")
    parser.add_argument(
        "--max-error", type=float, default=0.05, metavar="M", help="of 95 %% of the map's surface (default %(default)s)"
    )
    parser.add_argument(
        "--max-lost-free",
        type=float,
        default=0.1,
        metavar="SHARE",
        help="free space that may be lost beyond what the best settings lose (default %(default)s)",
    )
    parser.add_argument("--resolutions", metavar="M,M,...", help="to try; default: around the error that is allowed")
    parser.add_argument("--budget", default="5min", metavar="TIME", help="as 60s, 5min or 1h (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("rayvox-tuning"), help="folder (default ./%(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Measure, write the report, say what to use."""
    from rayvox.tune import Budget, Progress, Target, tune
    from rayvox.tune.report import write_report

    budget_s = duration_s(arguments.budget)
    scans = _scans(arguments)
    report = tune(
        scans,
        Target(_positive(arguments.max_error, "--max-error"), arguments.max_lost_free),
        arguments.out / "results.jsonl",
        _robot(arguments.robot),
        budget_s,
        _resolutions(arguments.resolutions),
        Progress(Budget(budget_s), sys.stderr),
    )
    written = write_report(report, arguments.out)
    print(report.recommendation.sentence())
    print(f"Start a service with it: rayvox serve --settings {written.settings}")
    print(f"All that was measured: {written.page}" + ("" if written.plots else " (plots need matplotlib)"))
    return 0


def duration_s(text: str) -> float:
    """60, 60s, 5min or 1h as seconds. Raises CommandError."""
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz")
    try:
        seconds = float(number) * _UNITS_S[text[len(number) :] or "s"]
    except (ValueError, KeyError):
        raise CommandError(f"--budget {text}: expected a time such as 60s, 5min or 1h") from None
    return _positive(seconds, "--budget")


def _positive(value: float, name: str) -> float:
    if not 0 < value < float("inf"):
        raise CommandError(f"{name} must be a number above zero, got {value}")
    return value


def _resolutions(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [_positive(float(word), "--resolutions") for word in text.split(",")]
    except ValueError:
        raise CommandError(f"--resolutions {text}: expected metres, separated by commas") from None


def _scans(arguments: argparse.Namespace) -> TuningInput:
    from rayvox.tune import recorded, simulated

    if (arguments.folder is None) == (arguments.simulate is None):
        raise CommandError("name a folder of scans, or --simulate N")
    if arguments.simulate is not None:
        return simulated(range(arguments.seed, arguments.seed + arguments.simulate), arguments.stations)
    reading = (
        arguments.max_range,
        arguments.bin_columns,
        arguments.intrinsics,
        arguments.depth_scale,
        arguments.extrinsic,
    )
    return recorded(posed_files(arguments), _reader(arguments), repr(reading))


def _reader(arguments: argparse.Namespace) -> Callable[[PosedFile], PosedScan]:
    from rayvox.tune import PosedScan

    T_pose_sensor, pixels = extrinsic(arguments.extrinsic), intrinsics(arguments.intrinsics)
    camera = None if pixels is None else DepthIntrinsics(*pixels, depth_scale_m=arguments.depth_scale)

    def read(file: PosedFile) -> PosedScan:
        points = read_points(file.path, bin_columns=arguments.bin_columns, intrinsics=camera).points
        return PosedScan(points, file.T_map_sensor @ T_pose_sensor, max_range_m=arguments.max_range)

    return read


def _robot(path: Path | None) -> Robot | None:
    from rayvox import Robot

    if path is None:
        return None
    return Robot.from_urdf(path) if path.suffix.lower() == ".urdf" else Robot.from_mesh(path)
