"""How long planners wait for answers while scans stream in.

    python -m benchmarks.query_latency [--seconds 20] [--write NAME]

The service runs in a process of its own on 127.0.0.1, journal and fdatasync included. Another process sends it depth
views of 76,800 rays of the simulated building at 10 Hz into a 5 cm map that has seen them before; this one asks for a
panda's collisions, over HTTP and over the WebSocket, one question after the other with a pause of its own length in
between. `quiet` is the same without scans. Needs the sample data (tests/support/datasets.py).

The last table is what a batch of 10,000 poses takes the client, against the kernel called with the same map in this
process.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rayvox
from rayvox.simulation.benchmark_views import wandering_views
from rayvox_client import Client, CollisionCheck

from benchmarks.report import print_table, provenance, write_results
from tests.support.datasets import data_folder
from tests.support.service_process import ServiceProcess

FloatArray = npt.NDArray[np.float64]
RESOLUTION_M = 0.05
RATE_HZ = 10.0
VIEWS = 60
BATCHES = (1, 100, 1000, 10_000)
KERNEL_REPEATS = 15
Ask = Callable[[FloatArray, FloatArray], CollisionCheck]


def stream_scans(url: str, started: Any, ended: Any) -> None:
    """Depth views at RATE_HZ, each when it is due, until told to end."""
    views = [(view.scan.points, view.scan.T_map_sensor) for view in wandering_views(VIEWS)]
    with Client(url).stream("building") as stream:
        for points, T_map_sensor in views:
            stream.push(points, T_map_sensor)
        stream.flush()
        started.set()
        due, sent = time.perf_counter(), 0
        while not ended.is_set():
            stream.push(*views[sent % VIEWS])
            sent, due = sent + 1, due + 1 / RATE_HZ
            time.sleep(max(0.0, due - time.perf_counter()))


def poses(robot: rayvox.Robot, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Configurations within the limits, on bases all over the building's floor."""
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, 3] = rng.uniform([-9, -5, 0.1], [9, 5, 0.5], (count, 3))
    return robot.sample_configurations(count, rng), T


def latencies_ms(ask: Ask, robot: rayvox.Robot, batch: int, seconds: float) -> tuple[FloatArray, int]:
    """Of each question asked within the time, and how many revisions the answers were of."""
    taken, revisions, ended = [], set(), time.perf_counter() + seconds
    ask(*poses(robot, batch, 0))
    while time.perf_counter() < ended:
        question = poses(robot, batch, len(taken))
        began = time.perf_counter()
        revisions.add(ask(*question).revision)
        taken.append(1e3 * (time.perf_counter() - began))
        time.sleep(min(1e-3 * taken[-1], 0.02))
    return np.array(taken), len(revisions)


def table(client: Client, robot: rayvox.Robot, load: str, seconds: float) -> list[list[object]]:
    rows: list[list[object]] = []
    with client.open_queries("building") as queries:
        ways: dict[str, Ask] = {
            "HTTP": lambda q, T: client.check("building", "panda", q, T),
            "WebSocket": lambda q, T: queries.check("panda", q, T),
        }
        for batch in BATCHES:
            for way, ask in ways.items():
                taken, revisions = latencies_ms(ask, robot, batch, seconds)
                p50, p99 = np.percentile(taken, [50, 99])
                rows.append([load, batch, way, len(taken), revisions, p50, p99, p99 / p50])
    return rows


def against_kernel(client: Client, robot: rayvox.Robot, local: rayvox.OccupancyMap) -> list[list[object]]:
    """Medians in milliseconds, calls taking turns."""
    q, T = poses(robot, 10_000, 1)
    checker = rayvox.CollisionChecker(local.snapshot(), robot)
    with client.open_queries("building") as queries:
        ways: dict[str, Callable[[], Any]] = {
            "kernel": lambda: checker.check(q, T),
            "HTTP": lambda: client.check("building", "panda", q, T),
            "WebSocket": lambda: queries.check("panda", q, T),
        }
        taken: dict[str, list[float]] = {way: [] for way in ways}
        for _ in range(KERNEL_REPEATS):
            for way, ask in ways.items():
                began = time.perf_counter()
                ask()
                taken[way].append(1e3 * (time.perf_counter() - began))
    medians = {way: float(np.median(times)) for way, times in taken.items()}
    return [[way, median, median / medians["kernel"]] for way, median in medians.items()]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="How long planners wait for answers while scans stream in.")
    parser.add_argument("--seconds", type=float, default=20.0, help="for each row")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    data = data_folder()
    if data is None:
        parser.error("the sample data is not here")
    header = provenance()
    folder = data / "robots" / "panda"
    robot = rayvox.Robot.from_urdf(min(folder.rglob("*.urdf")), root=folder)
    context = multiprocessing.get_context("spawn")
    started, ended = context.Event(), context.Event()
    with tempfile.TemporaryDirectory() as place, ServiceProcess(Path(place)) as service:
        client = Client(service.await_ready().url)
        client.upload_robot(folder, "panda")
        client.create_map("building", RESOLUTION_M)
        sender = context.Process(target=stream_scans, args=(service.url, started, ended))
        sender.start()
        started.wait()
        rows = table(client, robot, "10 scans/s", arguments.seconds)
        ended.set()
        sender.join()
        rows += table(client, robot, "quiet", arguments.seconds / 4)
        local = rayvox.OccupancyMap.load(str(client.download_map("building", Path(place) / "building.ot")))
        ratios = against_kernel(client, robot, local)
    print(header)
    columns = ["load", "poses", "way", "questions", "revisions", "p50 ms", "p99 ms", "p99 / p50"]
    print_table(columns, rows)
    print_table(["10,000 poses", "ms", "of the kernel's"], ratios)
    if arguments.write:
        print("written:", write_results(arguments.write, header, {"latency": rows, "ten_thousand": ratios}))


if __name__ == "__main__":
    main()
