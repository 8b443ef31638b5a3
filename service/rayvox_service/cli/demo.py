"""Start a service, map a simulated robot run with it, ask it questions, and leave it up."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.connection import connect

if TYPE_CHECKING:
    from rayvox.simulation import RobotRun
    from rayvox_client import Client, Occupancy

MAP_NAME = "demo"
PATH_BOXES = 120


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Length of the run, and what becomes of it."""
    parser.add_argument("--data-dir", type=Path, default=Path("rayvox-demo"), help="default ./%(default)s")
    parser.add_argument("--port", type=int, default=8080, help="default %(default)s, or a free one where it is taken")
    parser.add_argument("--stations", type=int, default=60, help="stops of the robot (default %(default)s)")
    parser.add_argument("--resolution", type=float, default=0.05, metavar="M", help="cell size (default %(default)s)")
    parser.add_argument("--record", type=Path, metavar="DIR", help="write the scans and poses there as well")
    parser.add_argument("--exit", action="store_true", help="stop the service at the end")


def run(arguments: argparse.Namespace) -> int:
    """The whole demo."""
    from rayvox.simulation import RobotRun

    from rayvox_service.cli.service_process import ServiceProcess

    if arguments.stations < 2:
        raise CommandError("--stations must be at least 2")
    # A plain `kill` must stop the service too, as Ctrl-C does.
    signal.signal(signal.SIGTERM, _interrupt)
    with ServiceProcess(arguments.data_dir, arguments.port) as service:
        print(f"service   {service.url} (data and log in {arguments.data_dir})")
        with connect(service.url) as client:
            _map_run(client, RobotRun(arguments.stations), arguments.resolution, arguments.record)
        if arguments.exit:
            return 0
        _say_what_next(service.url, arguments.record)
        try:
            service.wait()
        except KeyboardInterrupt:
            print("\nstopping the service")
    return 0


def _map_run(client: Client, robot_run: RobotRun, resolution_m: float, record: Path | None) -> None:
    from rayvox.simulation import path_length_m
    from rayvox_client import NotFoundError

    from rayvox_service.cli.run_scans import RunScans

    with contextlib.suppress(NotFoundError):
        client.delete_map(MAP_NAME)
    client.create_map(MAP_NAME, resolution_m=resolution_m)
    sweeps = len(robot_run) - robot_run.stations
    lens, lidar = robot_run.camera.intrinsics, robot_run.lidar
    print(
        f"robot     drives {path_length_m():.0f} m through a simulated office floor: {robot_run.stations} depth images "
        f"({lens.width}x{lens.height}), {sweeps} lidar sweeps ({lidar.rings}x{lidar.columns})",
        flush=True,
    )
    report = client.upload_sequence(MAP_NAME, RunScans(robot_run, record), wait="applied")
    print(
        f"upload    {report.scans} scans with {report.points:,} points simulated, sent, journaled and mapped "
        f"in {report.seconds:.1f} s"
    )
    _ask_for_the_path(client)
    _show_map(client, robot_run)


def _ask_for_the_path(client: Client) -> None:
    from rayvox.simulation import robot_boxes, robot_poses

    poses = robot_poses(PATH_BOXES)
    on_path = client.boxes(MAP_NAME, *robot_boxes(poses))
    poses[:, :2, 3] += 1.0 * poses[:, :2, 1]
    beside = client.boxes(MAP_NAME, *robot_boxes(poses))
    print(f"path      {PATH_BOXES} robot-sized boxes along the drive:  {_counts(on_path)}")
    print(f"          the same boxes 1 m to its left:      {_counts(beside)}")


def _counts(answer: Occupancy) -> str:
    return (
        f"{np.count_nonzero(answer.free):>4} free {np.count_nonzero(answer.occupied):>4} occupied "
        f"{np.count_nonzero(answer.unknown):>4} unknown"
    )


def _show_map(client: Client, robot_run: RobotRun) -> None:
    from rayvox_service.cli.floor_plan import SLICE_M, floor_plan
    from rayvox_service.cli.map_report import statistics_lines

    info = client.map_info(MAP_NAME, statistics=True)
    print(f"map       '{MAP_NAME}' at revision {info.revision}, {info.resolution_m:g} m cells")
    for line in statistics_lines(info.statistics or {}):
        print(f"          {line}")
    path = robot_run.base_poses()[:, :2, 3]
    encoding = getattr(sys.stdout, "encoding", None)
    print(f"\nThe map between {SLICE_M[0]} m and {SLICE_M[1]} m above the floor, with the robot's stops:\n")
    for line in floor_plan(client, MAP_NAME, (-10.3, -6.3), (10.3, 6.3), path, encoding=encoding):
        print(f"  {line}")


def _say_what_next(url: str, record: Path | None) -> None:
    option = "" if url.endswith(":8080") else f" --url {url}"
    print(f"\nThe service stays up at {url}. In another terminal:\n")
    print(f"  .venv/bin/rayvox info {MAP_NAME}{option}")
    print(f"  .venv/bin/rayvox export {MAP_NAME} {MAP_NAME}.ply{option}")
    if record is not None:
        print(f"  .venv/bin/rayvox upload again {record}{option}")
    print(f"  curl {url}/v1/maps\n\nCtrl-C stops it.", flush=True)


def _interrupt(signal_number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt
