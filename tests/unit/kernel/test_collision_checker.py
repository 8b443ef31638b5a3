from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import rayvox
from rayvox.collision_checker import CollisionChecker
from rayvox.self_collision import self_collisions

from tests.support.robots import arm_archive, one_link, zipped


def wall_map(resolution_m: float = 0.1) -> rayvox.OccupancyMap:
    """One occupied cell around (1.05, 0.05, 0.05)."""
    occupancy_map = rayvox.OccupancyMap(resolution_m)
    occupancy_map.insert_scan([[1.05, 0.05, 0.05]], origin=(0.55, 0.05, 0.05))
    return occupancy_map


def box_robot(size: str = "0.2 0.2 0.2") -> rayvox.Robot:
    return rayvox.Robot.from_archive(zipped({"a.urdf": one_link(f'<box size="{size}"/>')}))


def at(*positions: tuple[float, float, float]) -> np.ndarray:
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    return poses


def test_a_box_collides_from_where_it_touches_the_voxel() -> None:
    checker = CollisionChecker(wall_map().snapshot(), box_robot())
    result = checker.check(T_map_base=at((0.85, 0, 0), (0.8999, 0, 0), (0.9001, 0, 0), (1.2001, 0, 0)))
    assert result.verdicts.tolist() == [0, 0, 1, 0]
    assert result.revision == 1
    assert result.contacts is None
    assert result.self_colliding is None


def test_contacts_name_link_voxel_and_log_odds() -> None:
    found = CollisionChecker(wall_map().snapshot(), box_robot()).check(
        T_map_base=at((0, 0, 0), (1, 0, 0)), contacts="all"
    )
    contacts = found.contacts
    assert contacts is not None
    assert contacts.pose.tolist() == [1]
    assert contacts.link.tolist() == [0]
    assert contacts.centre_m == pytest.approx(np.array([[1.05, 0.05, 0.05]]))
    assert contacts.size_m == pytest.approx([0.1])
    assert contacts.log_odds == pytest.approx([0.8473], abs=1e-4)


def test_a_voxel_wholly_inside_the_robot_collides() -> None:
    checker = CollisionChecker(wall_map().snapshot(), box_robot("1 1 1"))
    assert checker.check(T_map_base=at((1.05, 0.05, 0.05))).verdicts.tolist() == [1]


def test_padding_and_threshold_move_the_verdict() -> None:
    snapshot, robot, pose = wall_map().snapshot(), box_robot(), at((0.85, 0, 0))
    assert CollisionChecker(snapshot, robot, padding_m=0.049).check(T_map_base=pose).verdicts.tolist() == [0]
    assert CollisionChecker(snapshot, robot, padding_m=0.051).check(T_map_base=pose).verdicts.tolist() == [1]
    assert CollisionChecker(snapshot, robot.with_padding(0.051)).check(T_map_base=pose).verdicts.tolist() == [1]
    touching = at((1, 0, 0))
    assert CollisionChecker(snapshot, robot, occupancy_threshold=0.69).check(T_map_base=touching).verdicts.tolist() == [
        1
    ]
    assert CollisionChecker(snapshot, robot, occupancy_threshold=0.71).check(T_map_base=touching).verdicts.tolist() == [
        0
    ]


def test_an_empty_map_is_unknown_everywhere() -> None:
    snapshot = rayvox.OccupancyMap(0.1).snapshot()
    assert CollisionChecker(snapshot, box_robot()).check().verdicts.tolist() == [0]
    assert CollisionChecker(snapshot, box_robot(), unknown="occupied").check().verdicts.tolist() == [2]


def test_links_that_touch_each_other_are_reported_and_allowed_ones_not() -> None:
    robot = rayvox.Robot.from_archive(arm_archive())
    rng = np.random.default_rng(0)
    q = robot.sample_configurations(300, rng)
    snapshot = rayvox.OccupancyMap(0.1).snapshot()
    result = CollisionChecker(snapshot, robot).check(q, self_collision=True)
    pairs = robot.self_collision_pairs()
    touching = rayvox.links_touch(robot, q, pairs)
    assert result.self_colliding is not None
    assert (result.self_colliding == touching.any(axis=1)).all()
    assert result.self_colliding.sum() > 0
    lenient = robot.with_allowed_collisions(
        robot.allowed_collisions.with_allowed([(robot.link_names[i], robot.link_names[j]) for i, j in pairs])
    )
    allowed = CollisionChecker(snapshot, lenient).check(q, self_collision=True).self_colliding
    assert allowed is not None
    assert not allowed.any()
    assert len(robot.with_always_touching_allowed(rayvox.links_touch, 50).self_collision_pairs()) <= len(pairs)


@pytest.mark.parametrize(
    "options",
    [{"unknown": "maybe"}, {"padding_m": -0.1}, {"padding_m": float("nan")}, {"occupancy_threshold": 1.0}],
)
def test_options_that_cannot_be_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(rayvox.InvalidInputError):
        CollisionChecker(wall_map().snapshot(), box_robot(), **options)  # type: ignore[arg-type]


def test_poses_that_cannot_be_are_refused() -> None:
    checker = CollisionChecker(wall_map().snapshot(), box_robot())
    with pytest.raises(rayvox.InvalidInputError):
        checker.check(T_map_base=2 * np.eye(4))
    with pytest.raises(rayvox.InvalidInputError, match="contacts"):
        checker.check(contacts="some")  # type: ignore[arg-type]


def test_padding_can_go_to_named_links_only() -> None:
    snapshot, robot, pose = wall_map().snapshot(), box_robot(), at((0.85, 0, 0))
    assert CollisionChecker(snapshot, robot, padding_m={"body": 0.051}).check(T_map_base=pose).verdicts.tolist() == [1]
    assert CollisionChecker(snapshot, robot, padding_m={}).check(T_map_base=pose).verdicts.tolist() == [0]
    for wrong in ({"tail": 0.1}, {"body": -0.1}, {"body": np.nan}):
        with pytest.raises(rayvox.InvalidInputError):
            CollisionChecker(snapshot, robot, padding_m=wrong)


def test_a_cancelled_query_ends_with_its_error_and_the_checker_goes_on() -> None:
    arm = rayvox.Robot.from_archive(arm_archive())
    checker = CollisionChecker(wall_map().snapshot(), arm)
    q = arm.sample_configurations(100, np.random.default_rng(0))
    cancellation = rayvox.CancellationToken()
    assert len(checker.check(q, self_collision=True, cancellation=cancellation).verdicts) == 100
    cancellation.cancel()
    assert cancellation.cancelled
    with pytest.raises(rayvox.QueryCancelledError):
        checker.check(q, cancellation=cancellation)
    with pytest.raises(rayvox.QueryCancelledError):
        checker.check_motion(q[:-1], q[1:], cancellation=cancellation)
    with pytest.raises(rayvox.QueryCancelledError):
        self_collisions(arm, arm.link_poses(q), cancellation)
    assert len(checker.check(q).verdicts) == 100


def test_a_query_is_cancelled_from_another_thread_while_it_runs() -> None:
    arm = rayvox.Robot.from_archive(arm_archive())
    checker = CollisionChecker(wall_map().snapshot(), arm)
    q = arm.sample_configurations(20_000, np.random.default_rng(0))
    cancellation, begun = rayvox.CancellationToken(), threading.Event()

    def ask_until_cancelled() -> None:
        while True:
            begun.set()
            checker.check(q, cancellation=cancellation)

    with ThreadPoolExecutor(1) as pool:
        asking = pool.submit(ask_until_cancelled)
        begun.wait()
        cancellation.cancel()
        assert isinstance(asking.exception(60), rayvox.QueryCancelledError)
