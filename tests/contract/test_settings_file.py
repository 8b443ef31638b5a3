"""What a settings file says is what the service does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rayvox import OccupancyMap
from rayvox.ray_sampling import kept_rays

from tests.support.mesh_files import CUBE_TRIANGLES, CUBE_VERTICES, stl_binary
from tests.support.service_process import (
    ServiceProcess,
    create_map,
    leaf_dict,
    put_scan,
    scan_frame,
    served_leaves,
    some_points,
)

SETTINGS = """
engine = "dda"
map_resolution_m = 0.2
map_depth = 14
map_max_range_m = 3.0
map_ray_share = 0.5
map_discretize = true
collision_unknown = "occupied"
"""


@pytest.fixture
def service(tmp_path: Path) -> Iterator[ServiceProcess]:
    (tmp_path / "settings.toml").write_text(SETTINGS)
    with ServiceProcess(tmp_path / "data", settings=tmp_path / "settings.toml") as running:
        yield running.await_ready()


def expected_leaves(scans: int) -> dict[tuple[int, ...], float]:
    octree = OccupancyMap(0.2, 14)
    for seed in range(scans):
        points = some_points(seed)
        octree.insert_scan(points[kept_rays(len(points), 0.5)], max_range_m=3.0, discretize=True)
    return leaf_dict(*octree.leaves())


def test_a_new_map_takes_scans_as_the_file_says_and_so_does_its_replay(service: ServiceProcess, tmp_path: Path) -> None:
    info = service.http.post("/v1/maps", json={"name": "lab"}).json()
    assert (info["resolution_m"], info["depth"]) == (0.2, 14)
    assert info["insertion"] == {"max_range_m": 3.0, "ray_share": 0.5, "discretize": True}
    for seed in range(3):
        scan_id, data = scan_frame(some_points(seed))
        answer = put_scan(service.http, "lab", scan_id, data)
        assert answer.json()["statistics"]["engine"] == "dda"
    assert served_leaves(service.http, "lab") == expected_leaves(3)
    service.stop()
    # The map keeps what it was created with, whatever the service is told later.
    with ServiceProcess(tmp_path / "data") as again:
        again.await_ready()
        assert served_leaves(again.http, "lab") == expected_leaves(3)


def test_the_longer_of_two_cuts_gives_way(service: ServiceProcess) -> None:
    service.http.post("/v1/maps", json={"name": "lab"})
    put_scan(service.http, "lab", *scan_frame(some_points(0), max_range_m=1.0))
    octree = OccupancyMap(0.2, 14)
    points = some_points(0)
    octree.insert_scan(points[kept_rays(len(points), 0.5)], max_range_m=1.0, discretize=True)
    assert served_leaves(service.http, "lab") == leaf_dict(*octree.leaves())


def test_a_creator_who_says_otherwise_is_heard(service: ServiceProcess) -> None:
    info = create_map(service.http, "fine", resolution_m=0.1)
    assert (info["resolution_m"], info["depth"], info["insertion"]["ray_share"]) == (0.1, 14, 0.5)
    wanted = {"name": "whole", "insertion": {}}
    assert service.http.post("/v1/maps", json=wanted).json()["insertion"] == {
        "max_range_m": None, "ray_share": 1.0, "discretize": False,
    }  # fmt: skip


def test_unknown_space_is_what_the_file_says_unless_the_query_does(service: ServiceProcess) -> None:
    service.http.post("/v1/maps", json={"name": "lab"})
    cube = stl_binary(CUBE_VERTICES, CUBE_TRIANGLES)
    response = service.http.put("/v1/robots/cube", content=cube, headers={"content-type": "model/stl"})
    assert response.status_code == 201, response.text
    nowhere = {"robot": "cube", "T_map_base": [np.eye(4).ravel().tolist()]}
    path = "/v1/maps/lab/collisions"
    assert service.http.post(path, json=nowhere).json()["verdicts"] == [2]
    assert service.http.post(path, json={**nowhere, "unknown": "free"}).json()["verdicts"] == [0]
