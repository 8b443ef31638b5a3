"""The client over TLS, with certificates of an authority made for the test."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Iterator

import numpy as np
import pytest
import trustme
from rayvox_client import AsyncClient, Client, ConnectionFailedError, Scan

from tests.support.loopback_service import LoopbackService

SCAN = Scan(np.arange(300_000, dtype=np.float32).reshape(-1, 3))


@pytest.fixture(scope="module")
def authority() -> trustme.CA:
    return trustme.CA()


@pytest.fixture
def service(authority: trustme.CA) -> Iterator[LoopbackService]:
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("127.0.0.1").configure_cert(tls)
    with LoopbackService(tls=tls) as running:
        running.add_map("lab")
        yield running


@pytest.fixture
def trusting(authority: trustme.CA) -> ssl.SSLContext:
    """What a client has whose trust store holds the authority."""
    context = ssl.create_default_context()
    authority.configure_trust(context)
    return context


def test_scans_go_over_tls_by_request_and_by_stream(service: LoopbackService, trusting: ssl.SSLContext) -> None:
    with Client(service.url, timeout_s=5, ssl_context=trusting) as client:
        assert client.insert("lab", SCAN).sequence == 1
        assert client.insert("lab", SCAN).duplicate
        with client.stream("lab") as stream:
            stream.push_scan(Scan(SCAN.points))
    assert [len(frame) for frame in service.scans["lab"].values()] == [len(SCAN.to_frame())] * 2
    assert service.scans["lab"][SCAN.scan_id] == SCAN.to_frame()
    assert service.connections == 2


def test_the_async_client_does_the_same(service: LoopbackService, trusting: ssl.SSLContext) -> None:
    async def upload() -> None:
        async with AsyncClient(service.url, timeout_s=5, ssl_context=trusting) as client:
            await client.insert("lab", SCAN)
            async with client.stream("lab") as stream:
                await stream.push_scan(Scan(SCAN.points))

    asyncio.run(upload())
    assert service.scans["lab"][SCAN.scan_id] == SCAN.to_frame()
    assert len(service.scans["lab"]) == 2


def test_a_service_that_nobody_vouches_for_gets_nothing(service: LoopbackService) -> None:
    with (
        Client(service.url, timeout_s=5, retries=0) as client,
        pytest.raises(ConnectionFailedError, match="certificate verify failed"),
    ):
        client.insert("lab", SCAN)
    assert service.seen == []


def test_a_certificate_for_another_name_is_refused(authority: trustme.CA, trusting: ssl.SSLContext) -> None:
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("robot.example").configure_cert(tls)
    with LoopbackService(tls=tls) as elsewhere:
        with (
            Client(elsewhere.url, timeout_s=5, retries=0, ssl_context=trusting) as client,
            pytest.raises(ConnectionFailedError, match="certificate"),
        ):
            client.health()
        assert elsewhere.seen == []
