"""rayvox's maps of single rays and small scans against the exact rational traversal."""

from __future__ import annotations

import numpy as np
import pytest
import rayvox
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rayvox.occupancy_map import Engine

from tests.support.leaf_comparison import assert_same_leaves
from tests.support.occupancy_oracle import OracleMap
from tests.support.rational_traversal import Cell, ray_cells
from tests.support.rayvox_maps import leaves_of
from tests.support.scenes import lattice_rays, random_rays, room_scan

Vector = tuple[float, float, float]
EXACT_ENGINES: tuple[Engine, ...] = ("dda", "beam", "embree", "auto")

half_cells = st.integers(-12, 12).map(lambda k: k / 2)
near_planes = st.builds(
    lambda k, ulps: float(k + ulps * np.spacing(max(abs(k), 1))), st.integers(-6, 6), st.integers(-2, 2)
)
coordinate = st.one_of(half_cells, near_planes, st.floats(-6, 6, allow_nan=False, allow_subnormal=False))
vector = st.tuples(coordinate, coordinate, coordinate)


def cells_in_map(
    origin: Vector,
    end: Vector,
    resolution_m: float,
    *,
    depth: int = 16,
    max_range_m: float | None = None,
    returned: bool = True,
    engine: Engine = "dda",
) -> tuple[set[Cell], set[Cell]]:
    """Free and occupied cells of a map into which one ray was inserted."""
    occupancy_map = rayvox.OccupancyMap(resolution_m, depth=depth)
    occupancy_map.insert_scan(
        np.array([end]) if returned else np.zeros((0, 3)),
        origin=origin,
        max_range_m=max_range_m,
        no_return=None if returned else np.array([end]) - origin,
        engine=engine,
    )
    keys, leaf_depth, log_odds = occupancy_map.leaves()
    assert (leaf_depth == depth).all()
    cells = [(x, y, z) for x, y, z in keys.tolist()]
    occupied = {cell for cell, value in zip(cells, log_odds.tolist(), strict=True) if value > 0}
    return set(cells) - occupied, occupied


def expected_cells(
    origin: Vector, end: Vector, resolution_m: float, max_range_m: float | None = None, returned: bool = True
) -> tuple[set[Cell], set[Cell]]:
    free, occupied = ray_cells(origin, end, resolution_m, max_range_m, returned)
    return set(free), set() if occupied is None else {occupied}


@settings(max_examples=300, deadline=None)
@given(vector, vector, st.sampled_from([1.0, 0.05, 0.1, 0.001, 10.0]), st.sampled_from(EXACT_ENGINES))
def test_one_ray_passes_the_cells_of_the_exact_traversal(
    origin: Vector, end: Vector, resolution_m: float, engine: Engine
) -> None:
    scaled = [tuple(float(x * resolution_m) for x in point) for point in (origin, end)]
    start, stop = (scaled[0][0], scaled[0][1], scaled[0][2]), (scaled[1][0], scaled[1][1], scaled[1][2])
    assert cells_in_map(start, stop, resolution_m, engine=engine) == expected_cells(start, stop, resolution_m)


@settings(max_examples=150, deadline=None)
@given(vector, vector, st.floats(0.25, 12.0), st.booleans(), st.sampled_from(EXACT_ENGINES))
def test_a_cut_or_silent_ray_frees_the_cells_of_the_exact_traversal_and_marks_none(
    origin: Vector, end: Vector, max_range_m: float, returned: bool, engine: Engine
) -> None:
    if not returned:
        # A silent ray is given by its reach from the origin: one more rounding, which the kernel makes too.
        reach = np.array(end) - origin
        x, y, z = (np.array(origin) + reach).tolist()
        end = (x, y, z)
    found = cells_in_map(origin, end, 1.0, max_range_m=max_range_m, returned=returned, engine=engine)
    assert found == expected_cells(origin, end, 1.0, max_range_m, returned)


CORNERS = {
    "through corners, upwards": ((0.5, 0.5, 0.5), (6.5, 6.5, 6.5)),
    "through corners, downwards": ((6.5, 6.5, 6.5), (-3.5, -3.5, -3.5)),
    "through corners, mixed": ((0.5, 6.5, 0.5), (6.5, 0.5, 6.5)),
    "through edges, mixed": ((0.5, 3.5, 0.25), (3.5, 0.5, 0.25)),
    "from corner to corner": ((-2.0, -2.0, -2.0), (3.0, 3.0, 3.0)),
    "from corner to corner, back": ((3.0, 3.0, 3.0), (-2.0, -2.0, -2.0)),
    "along an edge": ((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)),
    "along an edge, back": ((5.0, 1.0, 2.0), (0.0, 1.0, 2.0)),
    "along a face": ((0.25, 2.0, 0.5), (5.75, 2.0, 3.25)),
    "along a face diagonally": ((0.0, 2.0, 0.0), (-4.0, 2.0, 4.0)),
    "axis-parallel": ((0.25, 0.5, -0.5), (-9.25, 0.5, -0.5)),
    "zero length": ((0.3, 0.3, 0.3), (0.3, 0.3, 0.3)),
    "zero length on a corner": ((1.0, -1.0, 0.0), (1.0, -1.0, 0.0)),
    "inside one cell": ((0.25, 0.25, 0.25), (0.75, 0.5, 0.25)),
    "ends on the face it runs to": ((0.5, 0.5, 0.5), (4.0, 0.5, 0.5)),
    "ends on the face it runs down to": ((4.5, 0.5, 0.5), (1.0, 0.5, 0.5)),
    "axis-parallel upwards, on an edge, one voxel": ((0.0, 0.0, 0.5), (0.0, 0.0, 1.5)),
    "one voxel": ((0.25, 0.5, 0.5), (1.25, 0.75, 0.5)),
    "one ulp short of a plane": ((0.5, 0.5, 0.5), (float(np.nextafter(3.0, 0.0)), 0.5, 0.5)),
    "one ulp off the diagonal": ((0.5, 0.5, 0.5), (4.5, float(np.nextafter(4.5, 9.0)), 4.5)),
    "nearly parallel": ((0.5, 1.0, 0.5), (5.5, float(np.nextafter(1.0, 0.0)), 0.5)),
}


@pytest.mark.parametrize("engine", EXACT_ENGINES)
@pytest.mark.parametrize("resolution_m", [1.0, 0.001, 0.05, 10.0])
@pytest.mark.parametrize("ray", CORNERS.values(), ids=CORNERS.keys())
def test_an_awkward_ray_passes_the_cells_of_the_exact_traversal(
    ray: tuple[Vector, Vector], resolution_m: float, engine: Engine
) -> None:
    start, stop = np.array(ray[0]) * resolution_m, np.array(ray[1]) * resolution_m
    origin, end = (start[0], start[1], start[2]), (stop[0], stop[1], stop[2])
    assert cells_in_map(origin, end, resolution_m, engine=engine) == expected_cells(origin, end, resolution_m)


def assert_scan_is_exact(
    origin: NDArray[np.float64],
    points: NDArray[np.float64],
    resolution_m: float,
    *,
    depth: int = 16,
    engine: Engine = "dda",
    max_range_m: float | None = None,
    no_return: NDArray[np.float64] | None = None,
) -> None:
    """`no_return`: reach from the origin, as the map takes it."""
    silent_ends = None if no_return is None else origin + no_return
    ours, oracle = rayvox.OccupancyMap(resolution_m, depth=depth), OracleMap(resolution_m, tree_depth=depth)
    for _ in range(2):
        ours.insert_scan(
            points, origin=tuple(origin.tolist()), max_range_m=max_range_m, no_return=no_return, engine=engine
        )
        oracle.insert_scan(points, origin, max_range_m, silent_ends)
    assert_same_leaves(leaves_of(ours), oracle.leaves())


@pytest.mark.parametrize("engine", EXACT_ENGINES)
@pytest.mark.parametrize("seed", range(6))
def test_a_scan_of_lattice_rays_is_exact(seed: int, engine: Engine) -> None:
    resolution_m = [1.0, 0.25, 0.05][seed % 3]
    origins, points = lattice_rays(np.random.default_rng(seed), 2000, resolution_m, 40)
    assert_scan_is_exact(origins[0], points, resolution_m, engine=engine)


@pytest.mark.parametrize("engine", EXACT_ENGINES)
@pytest.mark.parametrize("resolution_m", [0.001, 0.05, 0.3, 10.0])
def test_a_scan_of_random_rays_is_exact(resolution_m: float, engine: Engine) -> None:
    rng = np.random.default_rng(23)
    origins, points = random_rays(rng, 3000, 60 * resolution_m)
    silent = random_rays(rng, 500, 60 * resolution_m)[0]
    assert_scan_is_exact(
        origins[0], points, resolution_m, engine=engine, max_range_m=70 * resolution_m, no_return=silent
    )


@pytest.mark.parametrize("engine", EXACT_ENGINES)
def test_a_scan_a_million_metres_from_the_origin_is_exact(engine: Engine) -> None:
    rng = np.random.default_rng(29)
    for centre_m, resolution_m in ((1.0e6, 1.0), (5.2e4, 0.05), (-1.0e6, 1.0)):
        origins, points = random_rays(rng, 1500, 40 * resolution_m, centre_m)
        assert_scan_is_exact(origins[0], points, resolution_m, depth=21, engine=engine)


@pytest.mark.parametrize("engine", EXACT_ENGINES)
@pytest.mark.parametrize("depth", [17, 19, 21])
def test_rays_of_many_thousand_voxels_are_exact(depth: int, engine: Engine) -> None:
    rng = np.random.default_rng(depth)
    directions = rng.normal(size=(6, 3))
    points = directions / np.linalg.norm(directions, axis=1, keepdims=True) * 0.9 * 2 ** (min(depth, 18) - 1) * 0.01
    assert_scan_is_exact(np.array([0.003, -0.001, 0.0]), points, 0.01, depth=depth, engine=engine)


@pytest.mark.parametrize("engine", EXACT_ENGINES)
def test_rays_of_a_hundred_thousand_voxels_are_exact(engine: Engine) -> None:
    along_faces_and_edges = [[50_000.0, 50_000.0, 0.0], [50_000.0, -49_999.0, 0.0], [-100_000.0, 0.0, 0.0]]
    aslant = [[61_234.5, 23_456.25, 15_309.75], [-33_333.3, 33_333.3, -33_333.3], [99_000.0, 0.5, -0.25]]
    assert_scan_is_exact(np.zeros(3), np.array(along_faces_and_edges + aslant), 1.0, depth=18, engine=engine)


ORIGINS = {
    "on a corner": (0.0, 0.0, 0.0),
    "on a corner below zero": (-3.0, 2.0, -1.0),
    "on an edge": (0.5, 1.0, -2.0),
    "on a face": (0.25, 0.5, 3.0),
    "an ulp below a corner": (float(np.nextafter(1.0, 0.0)), float(np.nextafter(-2.0, -3.0)), -5e-324),
    "inside a voxel": (0.3, 0.6, -0.2),
}


@pytest.mark.parametrize("engine", EXACT_ENGINES)
@pytest.mark.parametrize("resolution_m", [1.0, 0.001, 10.0])
@pytest.mark.parametrize("start", ORIGINS.values(), ids=ORIGINS.keys())
def test_thousands_of_awkward_rays_from_one_origin_are_exact(
    start: Vector, resolution_m: float, engine: Engine
) -> None:
    """Lattice ends, so rays along faces and edges and through corners; some a hair beside them, some random."""
    rng = np.random.default_rng(41)
    ends = rng.integers(-40, 41, (6000, 3)) / 2.0
    ends[:2000] += start  # parallel to what the others are
    ends[2000:3000] += rng.choice([-1e-13, 0.0, 1e-13], (1000, 3))
    ends[3000:4000] = rng.uniform(-20, 20, (1000, 3))
    ends[0] = start
    assert_scan_is_exact(np.array(start) * resolution_m, ends * resolution_m, resolution_m, engine=engine)


@pytest.mark.parametrize("engine", EXACT_ENGINES)
def test_rays_that_start_inside_an_occupied_voxel_free_it_exactly(engine: Engine) -> None:
    ours, oracle = rayvox.OccupancyMap(0.1), OracleMap(0.1)
    inside, outside = np.array([0.234, -0.511, 0.377]), np.array([1.0, 0.5, -0.2])
    around = random_rays(np.random.default_rng(43), 2000, 1.0)[1]
    scans = [(outside, inside[None])] * 4 + [(inside, around)] * 3 + [(outside, inside[None]), (inside, around)]
    for origin, points in scans:
        ours.insert_scan(points, origin=tuple(origin.tolist()), engine=engine)
        oracle.insert_scan(points, origin)
        assert_same_leaves(leaves_of(ours), oracle.leaves())
    assert ours.states_at([inside]).tolist() != [0]


def test_the_engines_asked_for_are_those_that_run() -> None:
    rng = np.random.default_rng(47)
    points = random_rays(rng, 6000, 20.0)[1]
    for engine in EXACT_ENGINES:
        ran = rayvox.OccupancyMap(1.0).insert_scan(points, origin=(0.3, 0.6, -0.2), engine=engine).statistics.engine
        assert engine in (ran, "auto")


@pytest.mark.parametrize("engine", EXACT_ENGINES)
def test_a_dense_scan_whose_free_space_prunes_is_exact(engine: Engine) -> None:
    rng = np.random.default_rng(31)
    origin = np.array([0.05, -0.02, 0.01])
    points = room_scan(rng, 20_000, 1.6, origin).astype(np.float64)
    assert_scan_is_exact(origin, points, 0.1, engine=engine)


def test_a_posed_scan_is_exact_for_points_moved_in_float64() -> None:
    rng = np.random.default_rng(37)
    quarter_turn = np.array([[0.0, -1.0, 0.0, 2.5], [1.0, 0.0, 0.0, -1.25], [0.0, 0.0, 1.0, 0.5], [0, 0, 0, 1.0]])
    points = room_scan(rng, 2000, 2.0, np.zeros(3))
    ours, oracle = rayvox.OccupancyMap(0.1), OracleMap(0.1)
    ours.insert_scan(points, quarter_turn)
    # A quarter turn is exact in float64, so the order of the sums does not matter.
    oracle.insert_scan(points.astype(np.float64) @ quarter_turn[:3, :3].T + quarter_turn[:3, 3], quarter_turn[:3, 3])
    assert_same_leaves(leaves_of(ours), oracle.leaves())
