"""Robot models: reading them, forward kinematics, motion bounds, levels of detail and the body filter.

    python -m benchmarks.robot_models [--write NAME]

On the robots of the sample data (see tests/support/datasets.py), one thread; medians.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import rayvox
from rayvox.robot import BodyFilter, Robot, simplified

from benchmarks.report import median_seconds, print_table, provenance, write_results
from tests.support.datasets import data_folder
from tests.support.robots import REAL_ROBOTS

CONFIGURATIONS = 1000
RAYS = 76_800
DETAIL_ERROR_M = 0.005


def measure(path: Path) -> dict[str, float]:
    robot = Robot.from_urdf(path)
    rng = np.random.default_rng(0)
    q = robot.sample_configurations(CONFIGURATIONS, rng)
    moved = q + rng.normal(scale=0.05, size=q.shape)
    visual = Robot.from_urdf(path, geometry="visual")
    began = time.perf_counter()
    levels = [simplified(link.mesh, DETAIL_ERROR_M) for link in visual.links if link.geometries]
    detail_s = time.perf_counter() - began
    directions = rng.normal(size=(RAYS, 3))
    points = directions / np.linalg.norm(directions, axis=1)[:, None] * rng.uniform(0.3, 5, (RAYS, 1))
    body = BodyFilter(robot.with_padding(0.02))
    beside = np.eye(4)
    beside[:3, 3] = [1.5, 0.0, 0.5]
    return {
        "links": len(robot.links),
        "read_collision_ms": 1e3 * median_seconds(lambda: Robot.from_urdf(path), 3),
        "read_visual_ms": 1e3 * median_seconds(lambda: Robot.from_urdf(path, geometry="visual"), 3),
        "link_poses_us": 1e6 * median_seconds(lambda: robot.link_poses(q), 9) / CONFIGURATIONS,
        "motion_bounds_us": 1e6 * median_seconds(lambda: robot.motion_bounds(q, moved), 9) / CONFIGURATIONS,
        "body_filter_ms": 1e3 * median_seconds(lambda: body.classify(points.astype(np.float32), q[0], beside), 5),
        "visual_triangles": visual.triangle_count,
        "detail_triangles": sum(len(level.mesh) for level in levels),
        "detail_s": detail_s,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", metavar="NAME", help="also write results/NAME.json")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        raise SystemExit("the sample data is not on this machine (RAYVOX_DATA names its folder)")
    rayvox.set_thread_count(1)
    header = provenance()
    results = {name: measure(folder / "robots" / name / "robot.urdf") for name in REAL_ROBOTS}
    columns = list(next(iter(results.values())))
    print_table(["robot", *columns], [[name, *row.values()] for name, row in results.items()])
    if arguments.write:
        print(write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
