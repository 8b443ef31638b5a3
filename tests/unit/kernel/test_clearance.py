from __future__ import annotations

import numpy as np
import pytest
import rayvox
from rayvox.collision_checker import CollisionChecker

from tests.support.robots import arm_archive, one_link, zipped
from tests.unit.kernel.test_collision_checker import at, box_robot, wall_map


def test_clearance_direction_point_and_voxel_of_a_box_beside_a_voxel() -> None:
    result = CollisionChecker(wall_map().snapshot(), box_robot()).clearance(T_map_base=at((0.5, 0.05, 0.05)))
    assert result.clearance_m == pytest.approx([0.4], abs=1e-12)
    assert result.clearance_m[0] <= 0.4
    assert result.is_lower_bound.tolist() == [False]
    assert result.direction == pytest.approx(np.array([[1.0, 0, 0]]))
    assert result.point_m[0, 0] == pytest.approx(0.6)
    assert (np.abs(result.point_m[0, 1:] - 0.05) <= 0.1).all()
    assert result.voxel_centre_m == pytest.approx(np.array([[1.05, 0.05, 0.05]]))
    assert result.voxel_size_m == pytest.approx([0.1])
    assert (result.link.tolist(), result.verdicts.tolist(), result.revision) == ([0], [0], 1)


def test_clearance_is_0_where_the_robot_collides_and_the_bound_where_it_is_cut_off() -> None:
    checker = CollisionChecker(wall_map().snapshot(), box_robot())
    result = checker.clearance(T_map_base=at((1, 0, 0), (0.5, 0, 0), (0, 0, 0)), max_clearance_m=0.5)
    assert result.clearance_m == pytest.approx([0, 0.4, 0.5])
    assert result.is_lower_bound.tolist() == [False, False, True]
    assert result.verdicts.tolist() == [1, 0, 0]
    assert result.link.tolist() == [-1, 0, -1]
    for column in (result.direction, result.point_m, result.voxel_centre_m, result.voxel_size_m):
        assert np.isnan(column[[0, 2]]).all()
        assert np.isfinite(column[1]).all()


def test_a_voxel_inside_of_a_closed_link_leaves_no_clearance() -> None:
    result = CollisionChecker(wall_map().snapshot(), box_robot("1 1 1")).clearance(T_map_base=at((1.05, 0.05, 0.05)))
    assert (result.clearance_m.tolist(), result.verdicts.tolist()) == ([0.0], [1])


def test_padding_shortens_the_distance_by_itself_or_more_and_never_below_what_check_says() -> None:
    snapshot, robot = wall_map().snapshot(), box_robot()
    faces, corners = at((0.5, 0.05, 0.05)), at((0.7, -0.3, -0.3))
    bare = CollisionChecker(snapshot, robot)
    padded = CollisionChecker(snapshot, robot.with_padding(0.03), padding_m=0.02)
    assert padded.clearance(T_map_base=faces).clearance_m == pytest.approx(
        bare.clearance(T_map_base=faces).clearance_m - 0.05
    )
    shorter = (bare.clearance(T_map_base=corners).clearance_m - padded.clearance(T_map_base=corners).clearance_m)[0]
    assert 0.05 < shorter <= 0.05 * np.sqrt(3) + 1e-12
    closer = np.linspace(0.7, 0.9, 50)
    poses = at(*[(x, -0.08, -0.08) for x in closer])
    touching = padded.check(T_map_base=poses).verdicts > 0
    assert ((padded.clearance(T_map_base=poses).clearance_m == 0) == touching).all()
    assert 0 < touching.sum() < 50


def test_unknown_space_counts_if_it_is_occupied() -> None:
    snapshot = wall_map().snapshot()  # free from x = 0.5 to 1, one cell wide
    robot, pose = box_robot("0.04 0.04 0.04"), at((0.75, 0.05, 0.04))
    assert CollisionChecker(snapshot, robot).clearance(T_map_base=pose).clearance_m == pytest.approx([0.23])
    minding = CollisionChecker(snapshot, robot, unknown="occupied").clearance(T_map_base=pose)
    # Beside a leaf of hundreds of metres the distance is rounded down by more.
    assert minding.clearance_m == pytest.approx([0.02], abs=1e-6)
    assert minding.clearance_m[0] <= 0.02
    assert minding.direction == pytest.approx(np.array([[0, 0, -1.0]]))


def test_a_robot_beyond_the_octree_is_measured_to_what_is_in_it() -> None:
    result = CollisionChecker(wall_map().snapshot(), box_robot()).clearance(
        T_map_base=at((1e5, 0.05, 0.05), (1e8, 0.05, 0.05))
    )
    assert result.clearance_m == pytest.approx([1e5 - 1.2, 1e8 - 1.2], rel=1e-9)
    assert result.direction == pytest.approx(np.array([[-1.0, 0, 0]] * 2), abs=1e-8)


def test_a_link_without_geometry_is_not_measured_and_links_are_named_by_their_index() -> None:
    extra = """<link name="tip"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
      <link name="bare"/>
      <joint name="a" type="fixed"><parent link="body"/><child link="bare"/></joint>
      <joint name="b" type="fixed"><parent link="bare"/><child link="tip"/><origin xyz="0.3 0 0"/></joint>"""
    robot = rayvox.Robot.from_archive(zipped({"a.urdf": one_link('<box size="0.2 0.2 0.2"/>', extra)}))
    result = CollisionChecker(wall_map().snapshot(), robot).clearance(T_map_base=at((0.5, 0.05, 0.05)))
    assert result.clearance_m == pytest.approx([0.15])
    assert result.link.tolist() == [robot.link_index("tip")]


def test_check_measures_clearance_too_if_asked() -> None:
    checker = CollisionChecker(wall_map().snapshot(), rayvox.Robot.from_archive(arm_archive()))
    q = checker.robot.sample_configurations(20, np.random.default_rng(0))
    check = checker.check(q, max_clearance_m=2.0)
    assert check.clearance is not None
    assert (check.clearance.clearance_m == checker.clearance(q, max_clearance_m=2.0).clearance_m).all()
    assert (check.clearance.verdicts == check.verdicts).all()
    assert checker.check(q).clearance is None


@pytest.mark.parametrize("bound", [0.0, -1.0, float("nan")])
def test_bounds_that_cannot_be_are_refused(bound: float) -> None:
    checker = CollisionChecker(wall_map().snapshot(), box_robot())
    with pytest.raises(rayvox.InvalidInputError):
        checker.clearance(max_clearance_m=bound)
    with pytest.raises(rayvox.InvalidInputError):
        checker.check(max_clearance_m=bound)
