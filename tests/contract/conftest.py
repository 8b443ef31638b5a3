from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
from rayvox_client import Client

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
