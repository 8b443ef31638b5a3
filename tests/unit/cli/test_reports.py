"""What the commands print about maps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from rayvox import OccupancyMap
from rayvox_client import Occupancy
from rayvox_service.cli.floor_plan import SLICE_M, floor_plan
from rayvox_service.cli.map_report import byte_text, statistics_lines


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 B"), (1023, "1023 B"), (1536, "1.5 KiB"), (5 << 20, "5.0 MiB"), (3 << 40, "3072.0 GiB")]
)
def test_a_size_has_a_fitting_unit(count: int, text: str) -> None:
    assert byte_text(count) == text


def test_the_kernels_statistics_are_all_shown() -> None:
    octree = OccupancyMap(0.5)
    octree.insert_scan(np.array([[3.25, 0.25, 0.25]]), max_range_m=10.0, origin=(0.25, 0.25, 0.25))
    statistics = octree.statistics()
    lines = statistics_lines(dataclasses.asdict(statistics))
    assert [line.split()[0] for line in lines] == ["occupied", "free", "octree", "extent"]
    assert f"{statistics.occupied_leaves:,} leaves" in lines[0]
    assert f"{statistics.free_volume_m3:,.2f} m3" in lines[1]
    assert lines[3].split()[1:6] == ["3.50", "x", "0.50", "x", "0.50"]


def test_an_empty_map_has_no_extent() -> None:
    lines = statistics_lines(dataclasses.asdict(OccupancyMap(0.1).statistics()))
    assert [line.split()[0] for line in lines] == ["occupied", "free", "octree"]


class LeftWall:
    """Stands in for the client: occupied west of x = 1, unknown north of y = 3."""

    def boxes(self, name: str, lo: NDArray[np.float64], hi: NDArray[np.float64]) -> Occupancy:
        assert (lo[:, 2] == SLICE_M[0]).all()
        assert (hi[:, 2] == SLICE_M[1]).all()
        center = (lo + hi) / 2.0
        states = np.where(center[:, 0] < 1.0, 2, np.where(center[:, 1] > 3.0, 0, 1))
        return Occupancy(states.astype(np.uint8), None, 1)


def test_the_floor_plan_has_north_up_west_left_and_the_path_in_it() -> None:
    path = np.array([[2.5, 0.5], [0.5, 0.5], [99.0, 0.0]])
    lines = floor_plan(LeftWall(), "lab", (0.0, 0.0), (4.0, 4.0), path, columns=8)  # type: ignore[arg-type]
    assert lines == ["##", "##......", "##......", "##...o.."]
    fancy = floor_plan(LeftWall(), "lab", (0.0, 0.0), (4.0, 4.0), path, columns=8, encoding="utf-8")  # type: ignore[arg-type]
    assert fancy[-1] == "██···•··"
