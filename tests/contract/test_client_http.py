"""The client over HTTP against a service that breaks: nothing lost, nothing doubled, every refusal typed."""

from __future__ import annotations

import asyncio
import socket
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rayvox_client import (
    AsyncClient,
    Client,
    ConnectionFailedError,
    InvalidInputError,
    MalformedAnswerError,
    MapExistsError,
    MapNotFoundError,
    OutOfRangeError,
    OverloadedError,
    RayvoxClientError,
    RetryPolicy,
    Scan,
    ScanConflictError,
    ServiceError,
    TooLargeError,
    UnauthorizedError,
    UnavailableError,
)

from tests.support.loopback_service import Fault, LoopbackService, problem

POINTS = np.arange(30_000, dtype=np.float32).reshape(-1, 3)
QUICK = RetryPolicy(retries=3, first_delay_s=0.001)


@pytest.fixture
def service() -> Iterator[LoopbackService]:
    with LoopbackService() as running:
        running.add_map("lab")
        yield running


@pytest.fixture
def client(service: LoopbackService) -> Iterator[Client]:
    with Client(service.url, retries=QUICK, timeout_s=5) as opened:
        yield opened


OVERLOADED = Fault(429, (("Retry-After", "0"),), problem("overloaded", 429, "queue full"))
UNAVAILABLE = Fault(503, (("Retry-After", "0"),), problem("unavailable", 503, "starting"))


@pytest.mark.parametrize(
    "fault",
    [
        Fault(),
        Fault(handle_first=True),
        Fault(read_body_bytes=1000),
        Fault(cut_answer=True),
        OVERLOADED,
        UNAVAILABLE,
    ],
    ids=["no answer", "answer lost", "dropped mid-body", "answer cut", "overloaded", "unavailable"],
)
def test_a_scan_survives_a_fault_and_is_there_once(service: LoopbackService, client: Client, fault: Fault) -> None:
    service.faults.append(fault)
    scan_id = str(uuid.uuid4())
    receipt = client.insert_scan("lab", POINTS, scan_id=scan_id)
    assert receipt.scan_id == scan_id
    assert receipt.duplicate == (fault.handle_first or fault.cut_answer)
    assert list(service.scans["lab"]) == [scan_id]
    assert {request.target for request in service.seen} == {f"/v1/maps/lab/scans/{scan_id}?wait=applied"}
    assert len({request.body for request in service.seen}) == 1


def test_the_async_client_survives_the_same_faults(service: LoopbackService) -> None:
    service.faults.extend([Fault(), Fault(read_body_bytes=1000), OVERLOADED])

    async def insert() -> None:
        async with AsyncClient(service.url, retries=QUICK, timeout_s=5) as client:
            receipt = await client.insert_scan("lab", POINTS)
            assert list(service.scans["lab"]) == [receipt.scan_id]

    asyncio.run(insert())


def test_a_service_that_starts_late_is_waited_for() -> None:
    with socket.create_server(("127.0.0.1", 0)) as reserved:
        port = reserved.getsockname()[1]
    with LoopbackService() as late:
        late.add_map("lab")
        waited: list[float] = []

        def forward() -> None:
            with socket.create_server(("127.0.0.1", port)) as listener:
                taken, _ = listener.accept()
                with taken, socket.create_connection(("127.0.0.1", int(late.url.rsplit(":", 1)[1]))) as onward:
                    onward.sendall(taken.recv(1 << 16))
                    taken.sendall(onward.recv(1 << 16))

        def draw() -> float:
            if not waited:
                threading.Thread(target=forward, daemon=True).start()
            waited.append(1.0)
            return 1.0

        policy = RetryPolicy(retries=50, first_delay_s=0.01, max_delay_s=0.05, draw=draw)
        assert Client(f"http://127.0.0.1:{port}", retries=policy, timeout_s=5).health() == "ok"
        assert waited


def test_used_up_retries_raise_what_happened_last(service: LoopbackService, client: Client) -> None:
    service.faults.extend([OVERLOADED] * 4)
    with pytest.raises(OverloadedError, match="queue full") as overloaded:
        client.insert_scan("lab", POINTS)
    assert overloaded.value.retry_after_s == 0.0
    service.faults.extend([Fault()] * 4)
    with pytest.raises(ConnectionFailedError):
        client.health()
    assert not service.faults


def test_a_retry_after_beyond_patience_raises_at_once(service: LoopbackService, client: Client) -> None:
    service.faults.append(Fault(503, (("Retry-After", "86400"),), problem("unavailable", 503, "maintenance")))
    with pytest.raises(UnavailableError) as error:
        client.health()
    assert error.value.retry_after_s == 86400.0
    assert len(service.seen) == 1


@pytest.mark.parametrize(
    ("status", "slug", "error_type"),
    [
        (404, "map-not-found", MapNotFoundError),
        (409, "scan-conflict", ScanConflictError),
        (422, "out-of-range", OutOfRangeError),
        (422, "invalid-input", InvalidInputError),
        (413, "too-large", TooLargeError),
        (401, "unauthorized", UnauthorizedError),
        (500, "internal", ServiceError),
    ],
)
def test_other_refusals_are_typed_and_not_tried_again(
    service: LoopbackService, client: Client, status: int, slug: str, error_type: type[ServiceError]
) -> None:
    service.faults.append(Fault(status, body=problem(slug, status, "because")))
    with pytest.raises(error_type, match="because") as error:
        client.insert_scan("lab", POINTS)
    assert isinstance(error.value, ServiceError)
    assert (error.value.status, error.value.slug, error.value.detail) == (status, slug, "because")
    assert len(service.seen) == 1


def test_an_answer_without_a_problem_document_is_typed_by_its_status(service: LoopbackService, client: Client) -> None:
    service.faults.append(Fault(413, body=b"<html>Request Entity Too Large</html>"))
    with pytest.raises(TooLargeError, match="Request Entity Too Large"):
        client.insert_scan("lab", POINTS)


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b'{"status": 5}', b'{"status": NaN}', b"\xff"])
def test_a_malformed_answer_raises_instead_of_being_believed(
    service: LoopbackService, client: Client, body: bytes
) -> None:
    service.faults.append(Fault(200, body=body))
    with pytest.raises(MalformedAnswerError):
        client.health()


def test_one_connection_serves_many_requests_and_a_closed_one_is_replaced(
    service: LoopbackService, client: Client
) -> None:
    for _ in range(5):
        client.health()
    assert service.connections == 1
    service.faults.append(Fault())
    client.health()
    assert service.connections == 2


def test_threads_share_a_client(service: LoopbackService, client: Client) -> None:
    def insert() -> None:
        for _ in range(10):
            client.insert_scan("lab", POINTS)

    threads = [threading.Thread(target=insert) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(service.scans["lab"]) == 40
    assert service.connections <= 4


def test_the_api_key_goes_along_and_stays_out_of_sight(service: LoopbackService) -> None:
    client = Client(service.url, api_key="secret-key")
    client.health()
    assert service.seen[-1].headers["authorization"] == "Bearer secret-key"
    assert "secret-key" not in repr(client)


def test_creating_a_map_whose_answer_was_lost_succeeds(service: LoopbackService, client: Client) -> None:
    service.faults.append(Fault(handle_first=True))
    assert client.create_map("new", 0.1).resolution_m == 0.1
    with pytest.raises(MapExistsError):
        client.create_map("new", 0.1)


def test_exist_ok_takes_only_a_map_with_the_same_settings(client: Client) -> None:
    created = client.create_map("new", 0.1)
    assert client.create_map("new", 0.1, exist_ok=True) == created
    with pytest.raises(MapExistsError, match="other settings"):
        client.create_map("new", 0.2, exist_ok=True)


def test_deleting_a_map_whose_answer_was_lost_succeeds(service: LoopbackService, client: Client) -> None:
    service.faults.append(Fault(handle_first=True))
    client.delete_map("lab")
    with pytest.raises(MapNotFoundError):
        client.delete_map("lab")


def test_queries_go_out_and_come_back_as_arrays(client: Client) -> None:
    answer = client.occupancy("lab", [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])
    assert answer.states.tolist() == [2, 2]
    assert answer.log_odds is not None
    assert answer.log_odds.dtype == np.float32
    assert answer.occupied.all()
    assert answer.revision == 7
    assert repr(answer) == "Occupancy(2 occupied, 0 free, 0 unknown at revision 7)"


def test_a_download_replaces_the_file_whole_or_not_at_all(
    service: LoopbackService, client: Client, tmp_path: Path
) -> None:
    target = tmp_path / "lab.bt"
    target.write_bytes(b"old")
    service.faults.extend([Fault(cut_answer=True)] * 4)
    with pytest.raises(ConnectionFailedError):
        client.download_map("lab", target)
    assert target.read_bytes() == b"old"
    assert client.download_map("lab", target) == target
    assert target.read_bytes() == b"octree" * 1000
    assert [path.name for path in tmp_path.iterdir()] == ["lab.bt"]
    with pytest.raises(InvalidInputError, match=r"\.bt, \.ot or \.ply"):
        client.download_map("lab", tmp_path / "lab.obj")


@pytest.mark.parametrize("via", ["stream", "http"])
def test_a_sequence_goes_up_with_a_report(
    service: LoopbackService, client: Client, via: str, capsys: pytest.CaptureFixture[str]
) -> None:
    scans = [Scan(POINTS) for _ in range(5)]
    assert via in ("stream", "http")
    report = client.upload_sequence("lab", scans, via="stream" if via == "stream" else "http", wait="applied")
    assert list(service.scans["lab"]) == [scan.scan_id for scan in scans]
    assert (report.scans, report.duplicates, report.points, report.last_sequence) == (5, 0, 50_000, 5)
    assert "5/5" in capsys.readouterr().err
    again = client.upload_sequence("lab", scans, progress=False)
    assert (again.scans, again.duplicates) == (5, 5)
    assert "5 there already" in str(again)
    assert capsys.readouterr().err == ""


def test_nothing_goes_out_after_close(client: Client) -> None:
    client.close()
    with pytest.raises(RayvoxClientError, match="closed"):
        client.health()
