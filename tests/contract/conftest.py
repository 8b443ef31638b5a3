from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
import rayvox
from rayvox_client import Client

from tests.support.arm_in_room import ROOM_POINTS, ROOM_RESOLUTION_M, room_snapshot
from tests.support.robots import arm_archive
from tests.support.service_process import ServiceProcess, create_map

_numbers = itertools.count()


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """One running service for all contract tests; each test has a map of its own."""
    with ServiceProcess(tmp_path_factory.mktemp("service-data")) as running:
        yield running.await_ready()


@pytest.fixture
def lab(service: ServiceProcess) -> str:
    """The name of a new, empty map of 0.25 m voxels."""
    name = f"lab-{next(_numbers)}"
    create_map(service.http, name)
    return name


@pytest.fixture
def client(service: ServiceProcess) -> Client:
    return Client(str(service.http.base_url))


@pytest.fixture(scope="session")
def robot(service: ServiceProcess) -> str:
    """The name of the uploaded arm (arm_in_room.ARM)."""
    answer = service.http.put("/v1/robots/arm", content=arm_archive(), headers={"content-type": "application/zip"})
    assert answer.status_code == 201, answer.text
    return "arm"


@pytest.fixture
def room(client: Client) -> str:
    """The name of a new map whose snapshot is `snapshot`."""
    name = f"room-{next(_numbers)}"
    client.create_map(name, resolution_m=ROOM_RESOLUTION_M)
    client.insert_scan(name, ROOM_POINTS)
    return name


@pytest.fixture(scope="session")
def snapshot() -> rayvox.MapSnapshot:
    return room_snapshot()
