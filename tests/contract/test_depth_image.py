"""A depth image of a map is the same through the kernel, the service and the client."""

from __future__ import annotations

import io

import numpy as np
import pytest
import rayvox
from PIL import Image
from rayvox import simulation
from rayvox_client import Client, Intrinsics, InvalidInputError

from tests.support.service_process import ServiceProcess

LENS = simulation.Intrinsics(80, 60, 50.0, 50.0, 39.5, 29.5)
CAMERA = rayvox.PinholeCamera(80, 60, 50.0, 50.0, 39.5, 29.5)


def test_the_kernel_the_service_and_the_client_agree(service: ServiceProcess, lab: str) -> None:
    view = simulation.benchmark_views(simulation.DepthCamera(LENS))["hall"].scan
    expected = rayvox.OccupancyMap(0.25)
    expected.insert_scan(view.points, view.T_map_sensor)
    with Client(service.url) as client:
        client.insert_scan(lab, view.points, view.T_map_sensor)
        seen = client.depth_image(lab, (60, 80), Intrinsics(50.0, 50.0, 39.5, 29.5), view.T_map_sensor)
        with pytest.raises(InvalidInputError):
            client.depth_image(lab, (60, 80), Intrinsics(50.0, 50.0, 39.5, 29.5), 2 * np.eye(4))
    wanted = expected.depth_image(CAMERA, view.T_map_sensor)
    np.testing.assert_array_equal(seen, wanted)
    assert (wanted > 0).mean() > 0.5

    pose = view.T_map_sensor.reshape(-1).tolist()
    body = {"T_map_camera": pose, "width": 80, "height": 60, "fx": 50, "fy": 50, "cx": 39.5, "cy": 29.5}
    answer = service.http.post(f"/v1/maps/{lab}/depth_image", json=body)
    assert answer.headers["content-type"] == "image/png"
    pixels = np.asarray(Image.open(io.BytesIO(answer.content)))
    np.testing.assert_allclose(pixels, wanted * 1000.0, atol=0.51)
    assert service.http.post(f"/v1/maps/{lab}/depth_image", json=body | {"width": 0}).status_code == 422
    assert (
        service.http.post(f"/v1/maps/{lab}/depth_image", json=body | {"width": 60000, "height": 60000}).status_code
        == 413
    )


def test_a_wall_is_seen_at_its_distance() -> None:
    occupancy_map = rayvox.OccupancyMap(0.1)
    y, z = np.meshgrid(np.arange(-2.95, 3, 0.1), np.arange(-2.95, 3, 0.1))
    occupancy_map.insert_scan(np.stack([np.full(y.size, 2.05), y.ravel(), z.ravel()], axis=1))
    forward_is_x = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    depth_m = occupancy_map.depth_image(CAMERA, forward_is_x)
    assert depth_m.shape == (60, 80)
    np.testing.assert_allclose(depth_m, 2.0, atol=1e-5)
    assert not occupancy_map.depth_image(CAMERA, forward_is_x, max_range_m=1.0).any()
