"""The local copy of a map, against a dictionary of finest-level cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rayvox_client import InvalidInputError, MalformedAnswerError, MapChanges, MapCopy, OutOfStepError
from rayvox_client.frame import decode_frame, encode_frame
from rayvox_client.map_changes import morton_codes

DEPTH = 5
RESOLUTION_M = 0.1
Node = tuple[int, int, int, int]


def changes(
    since: int, revision: int, regions: list[Node], leaves: dict[Node, float], full: bool = False, depth: int = DEPTH
) -> MapChanges:
    """Nodes are (x, y, z, depth)."""
    fields = {"since": since, "revision": revision, "full": full, "resolution_m": RESOLUTION_M, "depth": depth}
    nodes = np.array(list(leaves), np.int32).reshape(-1, 4)
    boxes = np.array(regions, np.int32).reshape(-1, 4)
    payloads: dict[str, NDArray[Any]] = {
        "region_keys": boxes[:, :3],
        "region_depth": boxes[:, 3].astype(np.uint8),
        "keys": nodes[:, :3],
        "leaf_depth": nodes[:, 3].astype(np.uint8),
        "log_odds": np.array(list(leaves.values()), np.float32),
    }
    return MapChanges.from_frame(decode_frame(encode_frame("changes", fields, payloads)))


def held(copy: MapCopy) -> dict[Node, float]:
    rows = zip(copy.keys.tolist(), copy.leaf_depth.tolist(), copy.log_odds.tolist(), strict=True)
    return {(x, y, z, d): value for (x, y, z), d, value in rows}


def node_at(x: int, y: int, z: int, depth: int) -> Node:
    width = 1 << (DEPTH - depth)
    return x // width * width, y // width * width, z // width * width, depth


def inside(leaf: Node, region: Node) -> bool:
    return leaf[3] >= region[3] and node_at(*leaf[:3], region[3]) == region


cells = st.integers(-(1 << (DEPTH - 1)), (1 << (DEPTH - 1)) - 1)
nodes = st.builds(node_at, cells, cells, cells, st.integers(2, DEPTH))

# Few enough that regions of one step often touch leaves of an earlier one.
close_cells = st.integers(-2, 1)
close_nodes = st.builds(node_at, close_cells, close_cells, close_cells, st.integers(3, DEPTH))


@st.composite
def rewrites(draw: st.DrawFn) -> tuple[list[Node], dict[Node, float]]:
    """Regions, and leaves within them that do not overlap."""
    regions = draw(st.lists(close_nodes, max_size=3))
    leaves: dict[Node, float] = {}
    for node in draw(st.lists(close_nodes, max_size=30)):
        within = any(inside(node, region) for region in regions)
        if within and not any(inside(node, leaf) or inside(leaf, node) for leaf in leaves):
            leaves[node] = draw(st.floats(-4, 4, width=32))
    return regions, leaves


@settings(max_examples=200)
@example([([(0, 0, -4, 3)], {(0, 0, -2, 4): 0.0}), ([(0, 0, -2, 5)], {})])  # a region smaller than the leaf it lies in
@given(st.lists(rewrites(), min_size=1, max_size=6))
def test_a_copy_holds_what_a_dictionary_would(steps: list[tuple[list[Node], dict[Node, float]]]) -> None:
    copy, expected = MapCopy(), dict[Node, float]()
    for revision, (regions, leaves) in enumerate(steps):
        after = {leaf: v for leaf, v in expected.items() if not any(inside(leaf, region) for region in regions)}
        covered = any(inside(new, old) for new in leaves for old in after)
        if covered:  # a node cannot be a leaf and hold leaves: no service says so
            with pytest.raises(MalformedAnswerError):
                changes(revision, revision + 1, regions, leaves).apply_to(copy)
            return
        changes(revision, revision + 1, regions, leaves).apply_to(copy)
        expected = after | leaves
        assert held(copy) == expected
        assert (copy.revision, len(copy)) == (revision + 1, len(expected))


@given(st.dictionaries(nodes, st.floats(-4, 4, width=32), max_size=20), st.data())
def test_points_are_looked_up_in_the_leaf_that_holds_them(drawn: dict[Node, float], data: st.DataObject) -> None:
    leaves: dict[Node, float] = {}
    for node, value in drawn.items():
        if not any(inside(node, leaf) or inside(leaf, node) for leaf in leaves):
            leaves[node] = value
    copy = MapCopy()
    changes(0, 1, [], leaves, full=True).apply_to(copy)
    asked = data.draw(st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=10))
    points = (np.array(asked) + 0.5) * RESOLUTION_M
    wanted = [
        next((v for leaf, v in leaves.items() if node_at(*cell, leaf[3]) == leaf), float("nan")) for cell in asked
    ]
    np.testing.assert_array_equal(copy.log_odds_at(points), np.array(wanted, np.float32))


def test_points_beyond_the_octree_are_unknown() -> None:
    copy = MapCopy()
    assert np.isnan(copy.log_odds_at([[0.0, 0.0, 0.0]])).all()
    changes(0, 1, [], {(-16, -16, -16, 0): 1.0}, full=True).apply_to(copy)
    values = copy.log_odds_at([[1.59, -1.6, 0.0], [1.61, 0.0, 0.0], [0.0, -1.61, 0.0], [1e300, 0.0, 0.0]])
    np.testing.assert_array_equal(values, np.array([1.0, np.nan, np.nan, np.nan], np.float32))
    with pytest.raises(InvalidInputError):
        copy.log_odds_at([[np.inf, 0.0, 0.0]])


def interleaved(key: NDArray[np.int64], depth: int) -> int:
    shifted = [int(k) + (1 << (depth - 1)) for k in key]
    return sum((shifted[axis] >> bit & 1) << (3 * bit + axis) for bit in range(depth) for axis in range(3))


@given(st.integers(1, 21), st.data())
def test_z_order_interleaves_the_bits_of_the_key(depth: int, data: st.DataObject) -> None:
    axis = st.integers(-(1 << (depth - 1)), (1 << (depth - 1)) - 1)
    keys = np.array(data.draw(st.lists(st.tuples(axis, axis, axis), min_size=1, max_size=5)))
    assert morton_codes(keys, depth).tolist() == [interleaved(key, depth) for key in keys]


def test_a_region_ends_before_its_neighbours_first_leaf() -> None:
    copy = MapCopy()
    changes(0, 1, [], {(0, 0, 0, 5): 1.0, (1, 1, 1, 5): 2.0, (2, 0, 0, 5): 3.0}, full=True).apply_to(copy)
    changes(1, 2, [(0, 0, 0, 4)], {}).apply_to(copy)
    assert held(copy) == {(2, 0, 0, 5): 3.0}


def test_a_leaf_within_a_leaf_that_stays_is_refused_and_nothing_happens() -> None:
    copy = MapCopy()
    changes(0, 1, [], {(0, 0, 0, 3): 1.0}, full=True).apply_to(copy)
    with pytest.raises(MalformedAnswerError, match="overlap"):
        changes(1, 2, [(2, 2, 2, 4)], {(2, 2, 2, 5): 2.0}).apply_to(copy)
    assert (held(copy), copy.revision) == ({(0, 0, 0, 3): 1.0}, 1)


def test_a_change_from_a_later_revision_is_refused_and_nothing_happens() -> None:
    copy = MapCopy()
    changes(0, 3, [], {(0, 0, 0, 5): 1.0}, full=True).apply_to(copy)
    with pytest.raises(OutOfStepError, match="starts at revision 4, the copy is at 3"):
        changes(4, 5, [(0, 0, 0, 4)], {}).apply_to(copy)
    assert (held(copy), copy.revision) == ({(0, 0, 0, 5): 1.0}, 3)


def test_a_change_that_reaches_back_is_applied_and_an_old_one_is_not() -> None:
    copy = MapCopy()
    changes(0, 3, [], {(0, 0, 0, 5): 1.0}, full=True).apply_to(copy)
    changes(1, 2, [(0, 0, 0, 4)], {}).apply_to(copy)
    assert (held(copy), copy.revision) == ({(0, 0, 0, 5): 1.0}, 3)
    changes(1, 4, [(0, 0, 0, 4)], {(1, 1, 1, 5): 2.0}).apply_to(copy)
    assert (held(copy), copy.revision) == ({(1, 1, 1, 5): 2.0}, 4)


def test_a_full_change_starts_anew_even_from_an_earlier_revision() -> None:
    copy = MapCopy()
    changes(0, 9, [], {(0, 0, 0, 5): 1.0}, full=True).apply_to(copy)
    changes(9, 2, [], {(3, 3, 3, 5): 2.0}, full=True).apply_to(copy)
    assert (held(copy), copy.revision) == ({(3, 3, 3, 5): 2.0}, 2)


def test_a_change_of_another_map_is_refused() -> None:
    copy = MapCopy()
    changes(0, 1, [], {}, full=True).apply_to(copy)
    with pytest.raises(OutOfStepError):
        changes(1, 2, [], {}, depth=6).apply_to(copy)


@pytest.mark.parametrize(
    "leaves", [{(0, 0, 0, 6): 1.0}, {(16, 0, 0, 5): 1.0}, {(0, 0, -17, 5): 1.0}], ids=["depth", "above", "below"]
)
def test_a_leaf_beyond_the_octree_is_refused(leaves: dict[Node, float]) -> None:
    with pytest.raises(MalformedAnswerError):
        changes(0, 1, [], leaves)


def test_centres_and_edges_are_in_metres() -> None:
    copy = MapCopy()
    assert len(copy.edge_m) == 0
    changes(0, 1, [], {(0, 0, 0, 5): 1.0, (-4, 4, 0, 3): 1.0}, full=True).apply_to(copy)
    found = {round(e, 6): c.round(6).tolist() for e, c in zip(copy.edge_m, copy.centers_m, strict=True)}
    assert found == {0.1: [0.05, 0.05, 0.05], 0.4: [-0.2, 0.6, 0.2]}
    assert "2 leaves" in repr(copy)
