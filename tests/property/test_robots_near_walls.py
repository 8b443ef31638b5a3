"""Real robots near the walls of published and simulated maps: verdicts against a brute force, and levels of detail."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
import rayvox
from rayvox.collision_checker import UnknownPolicy
from rayvox.simulation import benchmark_views

from tests.support.datasets import data_path
from tests.support.map_brute_force import MapBruteForce
from tests.support.robots import REAL_ROBOTS, real_robot

FloatArray = npt.NDArray[np.float64]
MAPS = ("fr_079.bt", "geb079.bt", "10 cm", "5 cm", "2.5 cm")
POSES = 60
TIE_M = 1e-9


@cache
def load_map(name: str) -> rayvox.MapSnapshot:
    if name.endswith(".bt"):
        return rayvox.OccupancyMap.load(str(data_path(f"octomap_maps/{name}"))).snapshot()
    simulated = rayvox.OccupancyMap(float(name.removesuffix(" cm")) / 100)
    for capture in list(benchmark_views().values())[:3]:
        simulated.insert_scan(capture.scan.points, capture.scan.T_map_sensor)
    return simulated.snapshot()


@cache
def load_robot(name: str, geometry: str = "collision") -> rayvox.Robot:
    return rayvox.Robot.from_urdf(real_robot(name), geometry="visual" if geometry == "visual" else "collision")


def near_walls(
    map_snapshot: rayvox.MapSnapshot, robot: rayvox.Robot, count: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Configurations, and bases upright or a little tilted about occupied voxels."""
    rng = np.random.default_rng(seed)
    keys, depth, log_odds = map_snapshot.leaves()
    walls = (keys[(log_odds >= 0) & (depth == map_snapshot.depth)] + 0.5) * map_snapshot.resolution_m
    T = np.tile(np.eye(4), (count, 1, 1))
    yaw, tilt = rng.uniform(0, 2 * np.pi, count), rng.normal(0, 0.1, count)
    zeros, ones = np.zeros(count), np.ones(count)
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), zeros], [np.sin(yaw), np.cos(yaw), zeros], [zeros, zeros, ones]])
    about_x = np.array(
        [[ones, zeros, zeros], [zeros, np.cos(tilt), -np.sin(tilt)], [zeros, np.sin(tilt), np.cos(tilt)]]
    )
    T[:, :3, :3] = np.moveaxis(about_z, 2, 0) @ np.moveaxis(about_x, 2, 0)
    T[:, :3, 3] = walls[rng.integers(len(walls), size=count)] + rng.normal(0, [0.6, 0.6, 0.3], (count, 3))
    return robot.sample_configurations(count, rng), T


@pytest.mark.parametrize("name", REAL_ROBOTS)
@pytest.mark.parametrize("map_name", MAPS)
def test_verdicts_are_those_of_every_triangle_against_every_voxel(map_name: str, name: str) -> None:
    map_snapshot, seed = load_map(map_name), MAPS.index(map_name)
    robot = load_robot(name)
    if seed % 2:
        robot = robot.with_padding(0.013)
    q, T = near_walls(map_snapshot, robot, POSES, seed)
    minding = rayvox.CollisionChecker(map_snapshot, robot, unknown="occupied").check(q, T).verdicts
    ignoring = rayvox.CollisionChecker(map_snapshot, robot).check(q, T).verdicts
    assert ((minding == 1) == (ignoring == 1)).all()
    assert set(ignoring.tolist()) <= {0, 1}
    oracle, decided = MapBruteForce(map_snapshot, robot), 0
    for verdict, T_map_links in zip(minding, robot.link_poses(q, T), strict=True):
        smaller, larger = (oracle.verdict(T_map_links, margin_m) for margin_m in (-TIE_M, TIE_M))
        decided += smaller == larger
        assert verdict in (smaller, larger)
    assert decided >= POSES - 1
    assert len(set(minding.tolist())) > 1


@pytest.mark.parametrize("name", REAL_ROBOTS)
@pytest.mark.parametrize("accuracy_m", [0.004, 0.02])
def test_levels_of_detail_miss_no_collision_and_invent_none_beyond_the_accuracy(name: str, accuracy_m: float) -> None:
    map_snapshot, robot = load_map("2.5 cm"), load_robot(name, "visual")
    q, T = near_walls(map_snapshot, robot, 1500, 7)
    policies: tuple[UnknownPolicy, ...] = ("free", "occupied")
    for unknown in policies:
        exact, wider, answer = (
            rayvox.CollisionChecker(map_snapshot, robot, unknown, padding_m, accuracy_m=accuracy).check(q, T).verdicts
            for padding_m, accuracy in ((0.0, None), (accuracy_m, None), (0.0, accuracy_m))
        )
        assert (answer[exact == 1] == 1).all()
        assert (answer[exact == 2] != 0).all()
        assert (wider[answer == 1] == 1).all()
        assert (wider[answer == 2] != 0).all()
        assert 0 < (exact == 1).sum() < len(exact)


def test_levels_of_detail_have_fewer_triangles_and_are_made_once() -> None:
    robot = load_robot("panda", "visual")
    link = max(robot.links, key=lambda link: len(link.mesh))
    body = link.body_within(0.01)
    assert 0 < body.error_m <= 0.005
    assert body.native is not None
    assert body.native.triangle_count < 0.2 * len(link.mesh)
    assert link.body_within(0.01) is body
    assert link.body_within(None).error_m == link.body_within(1e-9).error_m == 0
    with pytest.raises(rayvox.InvalidInputError, match="accuracy_m"):
        rayvox.CollisionChecker(load_map("10 cm"), robot, accuracy_m=-1.0)
