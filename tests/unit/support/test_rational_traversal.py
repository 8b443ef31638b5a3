from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.rational_traversal import (
    Cell,
    cell_of,
    cut_end,
    distance_to_boundary,
    passed_cells,
    ray_cells,
    segment_meets_cell,
    traversal_margin,
)
from tests.support.scenes import lattice_rays, random_rays

coordinate = st.one_of(
    st.integers(-4, 4).map(float),
    st.integers(-8, 8).map(lambda k: k / 2),
    st.floats(-4, 4, allow_nan=False, width=32),
    st.floats(-4, 4, allow_nan=False),
)
point = st.tuples(coordinate, coordinate, coordinate)


def cells_by_intersection(origin: tuple[float, ...], end: tuple[float, ...]) -> set[Cell]:
    ranges = [range(math.floor(min(o, e)) - 1, math.floor(max(o, e)) + 2) for o, e in zip(origin, end, strict=True)]
    cells = ((x, y, z) for x, y, z in itertools.product(*ranges))
    return {cell for cell in cells if segment_meets_cell(origin, end, cell)}


@settings(max_examples=150, deadline=None)
@given(point, point)
def test_passed_cells_are_those_an_interval_test_of_every_cell_finds(
    origin: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    cells = passed_cells(origin, end)
    assert len(set(cells)) == len(cells)
    assert set(cells) == cells_by_intersection(origin, end)
    assert (cells[0], cells[-1]) == (cell_of(origin), cell_of(end))


@pytest.mark.parametrize("seed", range(3))
def test_lattice_rays_agree_with_the_interval_test(seed: int) -> None:
    origins, ends = lattice_rays(np.random.default_rng(seed), 60, 1.0, 3)
    for origin, end in zip(origins.tolist(), ends.tolist(), strict=True):
        assert set(passed_cells(origin, end)) == cells_by_intersection(tuple(origin), tuple(end))


def test_the_interval_test_accepts_sampled_points_of_the_segment() -> None:
    origins, ends = random_rays(np.random.default_rng(7), 40, 5.0)
    for origin, end in zip(origins.tolist(), ends.tolist(), strict=True):
        passed = set(passed_cells(origin, end))
        for step in range(65):
            t = Fraction(step, 64)
            at = [Fraction(o) + (Fraction(e) - Fraction(o)) * t for o, e in zip(origin, end, strict=True)]
            cell = (math.floor(at[0]), math.floor(at[1]), math.floor(at[2]))
            assert cell in passed
            assert segment_meets_cell(origin, end, cell)


def test_two_upward_crossings_at_once_step_diagonally() -> None:
    assert passed_cells((0.5, 0.5, 0.5), (2.5, 2.5, 2.5)) == [(0, 0, 0), (1, 1, 1), (2, 2, 2)]


def test_two_downward_crossings_at_once_step_diagonally() -> None:
    assert passed_cells((1.5, 1.5, 0.5), (0.5, 0.5, 0.5)) == [(1, 1, 0), (0, 0, 0)]


def test_an_upward_and_a_downward_crossing_at_once_visit_the_cell_between() -> None:
    assert passed_cells((0.5, 1.5, 0.5), (1.5, 0.5, 0.5)) == [(0, 1, 0), (1, 1, 0), (1, 0, 0)]


def test_a_ray_that_starts_on_a_corner_and_goes_down_begins_in_the_cell_above() -> None:
    assert passed_cells((1.0, 1.0, 1.0), (0.5, 0.5, 0.5)) == [(1, 1, 1), (0, 0, 0)]


def test_a_ray_that_goes_up_and_ends_on_a_face_ends_in_the_cell_above_it() -> None:
    assert passed_cells((0.5, 0.0, 0.0), (1.0, 0.0, 0.0)) == [(0, 0, 0), (1, 0, 0)]


def test_a_ray_that_goes_down_and_ends_on_a_face_does_not_cross_it() -> None:
    assert passed_cells((1.5, 0.0, 0.0), (1.0, 0.0, 0.0)) == [(1, 0, 0)]


def test_a_ray_of_no_length_frees_nothing_and_marks_its_cell() -> None:
    assert ray_cells((0.07, 0.0, -0.01), (0.07, 0.0, -0.01), 0.05) == ([], (1, 0, -1))


def test_a_cut_ray_marks_no_end_and_frees_up_to_the_cell_of_the_cut() -> None:
    free, occupied = ray_cells((0.5, 0.5, 0.5), (9.5, 0.5, 0.5), 1.0, max_range_m=3.0)
    assert (free, occupied) == ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], None)


def test_a_ray_exactly_as_long_as_the_range_is_not_cut() -> None:
    end, cut = cut_end((0.0, 0.0, 0.0), (3.0, 0.0, 4.0), 5.0)
    assert not cut
    assert end.tolist() == [3.0, 0.0, 4.0]


def test_a_ray_without_return_frees_its_cells_but_the_last() -> None:
    assert ray_cells((0.5, 0.5, 0.5), (2.5, 0.5, 0.5), 1.0, returned=False) == ([(0, 0, 0), (1, 0, 0)], None)


@settings(max_examples=150, deadline=None)
@given(point, point, st.tuples(st.integers(-4, 3), st.integers(-4, 3), st.integers(-4, 3)))
def test_the_margin_is_positive_only_inside_and_negative_only_outside(
    origin: tuple[float, float, float], end: tuple[float, float, float], cell: Cell
) -> None:
    margin = traversal_margin(origin, end, cell)
    meets = segment_meets_cell(origin, end, cell)
    assert meets or margin <= 0
    assert not meets or margin >= 0
    sampled = max(
        min(
            min(o + (e - o) * Fraction(step, 16) - k, k + 1 - o - (e - o) * Fraction(step, 16))
            for o, e, k in zip(map(Fraction, origin), map(Fraction, end), cell, strict=True)
        )
        for step in range(17)
    )
    assert margin >= sampled


def test_the_margin_of_a_ray_past_an_edge_is_its_distance_to_that_edge() -> None:
    # The line x + y = 1.75 misses the corner (1, 1) of cell (0, 0) by 1/8 along each axis, inwards.
    assert traversal_margin((0.0, 1.75, 0.5), (1.75, 0.0, 0.5), (0, 0, 0)) == Fraction(1, 8)
    assert traversal_margin((0.0, 2.25, 0.5), (2.25, 0.0, 0.5), (0, 0, 0)) == Fraction(-1, 8)
    assert traversal_margin((0.0, 2.0, 0.5), (2.0, 0.0, 0.5), (0, 0, 0)) == 0


def test_the_distance_to_a_cells_boundary_is_measured_from_inside_and_outside() -> None:
    assert distance_to_boundary((0.25, 0.5, 0.5), (0, 0, 0)) == Fraction(1, 4)
    assert distance_to_boundary((1.25, 0.5, 0.5), (0, 0, 0)) == Fraction(1, 4)
