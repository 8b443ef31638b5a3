"""The kernel's Python API: what it accepts, what it refuses, what it answers."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rayvox
from rayvox.errors import InvalidInputError, MapFormatError, OutOfRangeError

IDENTITY = np.eye(4)


def small_map(depth: int = 16) -> rayvox.OccupancyMap:
    m = rayvox.OccupancyMap(0.1, depth=depth)
    rng = np.random.default_rng(3)
    m.insert_scan(rng.uniform(-2, 2, (500, 3)).astype(np.float32), origin=(0.01, 0.02, 0.03))
    return m


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": np.zeros((0, 3))}, "empty scan"),
        ({"points": np.zeros((4, 2))}, r"points must have shape \(n, 3\), got \(4, 2\)"),
        ({"points": "nothing"}, "points must be an array of numbers"),
        ({"points": [[1.0, np.nan, 0.0]]}, r"points\[0\] is not finite"),
        ({"points": [[0.0, 0.0, 0.0], [np.inf, 0.0, 0.0]]}, r"points\[1\] is not finite"),
        ({"points": [[1.0, 0, 0]], "T_map_sensor": np.eye(3)}, r"T_map_sensor must have shape \(4, 4\)"),
        ({"points": [[1.0, 0, 0]], "T_map_sensor": np.diag([2.0, 2, 2, 1])}, "not rigid"),
        ({"points": [[1.0, 0, 0]], "T_map_sensor": np.full((4, 4), np.nan)}, r"pose\[0\]\[0\] is not finite"),
        ({"points": [[1.0, 0, 0]], "origin": (0, 0)}, "origin must be three numbers"),
        ({"points": [[1.0, 0, 0]], "origin": (np.nan, 0, 0)}, "origin is not finite"),
        ({"points": [[1.0, 0, 0]], "max_range_m": -1.0}, "max_range_m must be positive"),
        ({"points": [[1.0, 0, 0]], "max_range_m": float("nan")}, "max_range_m must be positive"),
        ({"points": [[1.0, 0, 0]], "no_return": [[np.nan, 0, 0]]}, r"no_return\[0\] is not finite"),
        ({"points": [[1.0, 0, 0]], "engine": "gpu"}, "engine must be one of"),
    ],
)
def test_a_bad_scan_is_refused_by_name_and_changes_nothing(arguments: dict[str, Any], message: str) -> None:
    m = small_map()
    before = m.to_bytes()
    with pytest.raises(InvalidInputError, match=message):
        m.insert_scan(**arguments)
    assert m.revision == 1
    assert m.to_bytes() == before


def test_coordinates_beyond_the_octree_are_refused_with_index_and_range() -> None:
    m = rayvox.OccupancyMap(0.1, depth=10)
    with pytest.raises(OutOfRangeError, match=r"points\[1\] .* beyond the octree's range of \+-51\.2"):
        m.insert_scan([[1.0, 0, 0], [51.3, 0, 0]])
    assert m.revision == 0
    m.insert_scan([[51.19, -51.2, 0]])
    # A ray that is cut at its range need not end inside.
    m.insert_scan([[1e12, 0, 0]], max_range_m=20.0)


@pytest.mark.parametrize("values", [(0.0, 16), (-1.0, 16), (float("nan"), 16), (0.1, 3), (0.1, 22)])
def test_an_impossible_map_is_refused(values: tuple[float, int]) -> None:
    with pytest.raises(InvalidInputError):
        rayvox.OccupancyMap(*values)


@pytest.mark.parametrize(
    "values",
    [
        {"p_hit": 0.4},
        {"p_hit": 1.0},
        {"p_miss": 0.6},
        {"p_miss": 0.0},
        {"p_clamp_min": 0.98},
        {"p_occupied": float("nan")},
    ],
)
def test_an_impossible_sensor_model_is_refused(values: dict[str, float]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(values)) if "p_clamp_min" not in values else "p_clamp_max"):
        rayvox.SensorModel(**values)


def test_float32_float64_lists_and_strided_arrays_give_the_same_map() -> None:
    points = np.random.default_rng(0).uniform(-3, 3, (200, 3)).astype(np.float32)
    wide = np.zeros((200, 6), dtype=np.float32)
    wide[:, ::2] = points
    maps = []
    for form in (points, points.astype(np.float64), points.tolist(), wide[:, ::2], np.asfortranarray(points)):
        m = rayvox.OccupancyMap(0.1)
        m.insert_scan(form)
        maps.append(m.to_bytes())
    assert len(set(maps)) == 1


def test_a_pose_moves_points_and_origin_alike() -> None:
    points = np.random.default_rng(1).uniform(-3, 3, (300, 3))
    T = np.array([[0.0, -1, 0, 4], [1, 0, 0, -2], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    moved, placed = rayvox.OccupancyMap(0.1), rayvox.OccupancyMap(0.1)
    moved.insert_scan(points, T_map_sensor=T, origin=(0.1, 0.2, 0.3))
    placed.insert_scan(points @ T[:3, :3].T + T[:3, 3], origin=tuple(T[:3, :3] @ [0.1, 0.2, 0.3] + T[:3, 3]))
    assert moved.to_bytes() == placed.to_bytes()


def test_discretize_equals_one_ray_per_end_point_voxel() -> None:
    points = np.random.default_rng(2).uniform(-1, 1, (5000, 3))
    a, b = rayvox.OccupancyMap(0.25), rayvox.OccupancyMap(0.25)
    result = a.insert_scan(points, discretize=True)
    centres = (np.unique(np.floor(points / 0.25), axis=0) + 0.5) * 0.25
    b.insert_scan(centres)
    assert a.to_bytes() == b.to_bytes()
    assert result.statistics.ray_count == len(centres)


def test_rays_without_return_clear_and_mark_nothing() -> None:
    m = rayvox.OccupancyMap(1.0)
    m.insert_scan(np.zeros((0, 3)), origin=(0.5, 0.5, 0.5), no_return=[[3.0, 0, 0]])
    assert m.states_at([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5], [3.5, 0.5, 0.5]]).tolist() == [1, 1, 0]


def test_a_map_that_was_saved_loads_with_the_same_leaves(tmp_path: Path) -> None:
    m = small_map()
    m.save(tmp_path / "map.ot")
    loaded = rayvox.OccupancyMap.load(tmp_path / "map.ot")
    for ours, theirs in zip(m.leaves(), loaded.leaves(), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.ot"]


def test_a_corrupt_map_file_is_refused_and_an_unknown_suffix_too(tmp_path: Path) -> None:
    m = small_map()
    m.save(tmp_path / "map.bt")
    data = (tmp_path / "map.bt").read_bytes()
    (tmp_path / "cut.bt").write_bytes(data[:-3])
    with pytest.raises(MapFormatError, match="truncated"):
        rayvox.OccupancyMap.load(tmp_path / "cut.bt")
    with pytest.raises(InvalidInputError, match="bt, ot, ply"):
        m.save(tmp_path / "map.xyz")


@pytest.mark.parametrize("depth", [6, 16, 21])
def test_bytes_hold_the_exact_state(depth: int) -> None:
    m = small_map(depth)
    back = rayvox.OccupancyMap.from_bytes(m.to_bytes(), 0.1, depth, revision=m.revision)
    assert (back.revision, back.depth, back.resolution_m) == (m.revision, depth, 0.1)
    assert back.to_bytes() == m.to_bytes()
    assert back.changes_since(0).full
    assert not back.changes_since(m.revision).full


def test_statistics_agree_with_the_leaves() -> None:
    m = small_map()
    keys, depth, log_odds = m.leaves()
    stats = m.statistics()
    edges = 0.1 * 2.0 ** (16 - depth.astype(float))
    assert stats.occupied_leaves == (log_odds >= 0).sum()
    assert stats.free_leaves == (log_odds < 0).sum()
    assert stats.occupied_volume_m3 == pytest.approx((edges[log_odds >= 0] ** 3).sum())
    assert stats.bounds_lo_m == pytest.approx(tuple(keys.min(axis=0) * 0.1))
    assert rayvox.OccupancyMap(0.1).statistics().bounds_lo_m is None


def test_leaves_in_a_box_are_the_leaves_that_touch_it() -> None:
    m = small_map()
    keys, depth, _ = m.leaves()
    low, high = np.array([-5, -3, 0]), np.array([4, 8, 2])
    size = 2 ** (16 - depth.astype(np.int64))[:, None]
    touching = ((keys <= high) & (keys + size > low)).all(axis=1)
    found, _, _ = m.leaves_in_box(low * 0.1 + 0.05, high * 0.1 + 0.05)
    np.testing.assert_array_equal(found, keys[touching])


def test_ply_lists_the_occupied_leaves() -> None:
    m = small_map()
    data = m.export_bytes("ply")
    header, body = data.split(b"end_header\n", 1)
    count = m.statistics().occupied_leaves
    assert f"element vertex {count}\n".encode() in header
    vertices = np.frombuffer(body, dtype=[("xyz", "<f8", 3), ("size", "<f4"), ("log_odds", "<f4")])
    assert len(vertices) == count
    assert (m.states_at(vertices["xyz"]) == 2).all()


def test_queries_refuse_what_makes_no_sense() -> None:
    m = small_map()
    with pytest.raises(InvalidInputError, match="depth must be from 0 to 16"):
        m.log_odds_at([[0.0, 0, 0]], depth=17)
    with pytest.raises(InvalidInputError, match=r"points\[0\] is not finite"):
        m.states_at([[np.nan, 0, 0]])
    with pytest.raises(InvalidInputError, match=r"boxes\[1\]"):
        m.box_states([[0, 0, 0], [1, 0, 0]], [[1, 1, 1], [0, 1, 1]])
    with pytest.raises(InvalidInputError, match="unknown must be"):
        m.cast_rays([[0.0, 0, 0]], [[1.0, 0, 0]], unknown="ignore")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"rays\[0\]: direction is zero"):
        m.cast_rays([[0.0, 0, 0]], [[0.0, 0, 0]])
    with pytest.raises(InvalidInputError, match="revision"):
        m.changes_since(-1)


def test_readers_in_other_threads_see_whole_revisions() -> None:
    m = rayvox.OccupancyMap(0.1)
    rng = np.random.default_rng(5)
    scans = [rng.uniform(-2, 2, (2000, 3)) for _ in range(30)]
    expected = {0: b""}
    copy = rayvox.OccupancyMap(0.1)
    for scan in scans:
        copy.insert_scan(scan)
        expected[copy.revision] = copy.to_bytes()
    wrong: list[int] = []

    def read() -> None:
        while m.revision < len(scans):
            snapshot = m.snapshot()
            if snapshot.to_bytes() != expected[snapshot.revision]:
                wrong.append(snapshot.revision)

    readers = [threading.Thread(target=read) for _ in range(3)]
    for reader in readers:
        reader.start()
    for scan in scans:
        m.insert_scan(scan)
    for reader in readers:
        reader.join()
    assert wrong == []
    assert m.to_bytes() == expected[len(scans)]
