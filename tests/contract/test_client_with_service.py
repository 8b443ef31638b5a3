"""The client against the real service, both on real sockets; the kernel itself says what the answers must be."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import uvicorn
from numpy.typing import NDArray
from pydantic import SecretStr
from rayvox import OccupancyMap
from rayvox_client import (
    AsyncClient,
    Client,
    DepthScan,
    Intrinsics,
    InvalidMapNameError,
    MapCopy,
    MapExistsError,
    MapNotFoundError,
    OutOfRangeError,
    RayvoxClientError,
    RetryPolicy,
    Scan,
    ScanConflictError,
    SensorModel,
    ServiceTimeoutError,
    TooLargeError,
    UnauthorizedError,
)
from rayvox_service.app import create_app
from rayvox_service.settings import Settings

KEY = "robot-key"
Suffix = Literal["bt", "ot", "ply"]
Leaves = tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.float32]]


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("data"), api_key=SecretStr(KEY), max_points=200_000, wait_s=0.5
    )
    listener = socket.create_server(("127.0.0.1", 0))
    config = uvicorn.Config(create_app(settings), ws="websockets-sansio", log_level="warning", ws_max_size=64 << 20)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    server.should_exit = True
    thread.join()


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(url, KEY, retries=RetryPolicy(first_delay_s=0.01)) as opened:
        yield opened


@pytest.fixture
def lab(client: Client, request: pytest.FixtureRequest) -> str:
    name = request.node.name.replace("[", "-").replace("]", "")[:64]
    return client.create_map(name, resolution_m=0.1).name


def scans(count: int, seed: int = 0) -> list[Scan]:
    """A sensor that turns and moves within a few metres; float32 points, some beams without return."""
    random = np.random.default_rng(seed)
    made = []
    for i in range(count):
        angle = 0.3 * i
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        pose[:3, 3] = random.uniform(-1, 1, 3)
        points = random.uniform(-4, 4, (500, 3)).astype(np.float32)
        made.append(Scan(points, pose, max_range_m=6.0, no_return=random.uniform(-3, 3, (20, 3))))
    return made


def mapped(sent: list[Scan]) -> OccupancyMap:
    """The map that the kernel builds from these scans directly."""
    expected = OccupancyMap(0.1)
    for scan in sent:
        expected.insert_scan(scan.points, scan.T_map_sensor, max_range_m=scan.max_range_m, no_return=scan.no_return)
    return expected


def in_order(leaves: Leaves) -> list[tuple[int, int, int, int, float]]:
    keys, depth, log_odds = leaves
    rows = zip(keys.tolist(), depth.tolist(), log_odds.tolist(), strict=True)
    return sorted((x, y, z, d, value) for (x, y, z), d, value in rows)


def copied(copy: MapCopy) -> Leaves:
    return copy.keys, copy.leaf_depth, copy.log_odds


@pytest.mark.parametrize("via", ["stream", "http"])
def test_an_uploaded_sequence_gives_the_kernels_own_map(client: Client, lab: str, via: str) -> None:
    sent = scans(12)
    report = client.upload_sequence(
        lab, sent, progress=False, via="stream" if via == "stream" else "http", wait="applied"
    )
    assert (report.scans, report.duplicates, report.refused) == (12, 0, ())
    copy = MapCopy()
    client.changes(lab, since=0).apply_to(copy)
    assert in_order(copied(copy)) == in_order(mapped(sent).leaves())
    assert copy.revision == client.map_info(lab).revision


def test_sending_a_sequence_twice_changes_nothing(client: Client, lab: str) -> None:
    sent = scans(4)
    first = client.upload_sequence(lab, sent, progress=False, wait="applied")
    again = client.upload_sequence(lab, sent, progress=False, via="http", wait="applied")
    assert (again.scans, again.duplicates, again.last_sequence) == (4, 4, first.last_sequence)
    assert client.map_info(lab).scans_applied == 4


def test_all_forms_of_a_scan_give_the_kernels_own_map(client: Client, lab: str) -> None:
    millimetres = np.random.default_rng(1).integers(-3000, 3000, (400, 3)).astype(np.int16)
    doubles = np.random.default_rng(2).uniform(-2, 2, (100, 3))
    pixels = np.zeros((4, 6), np.uint16)
    pixels[1, 2], pixels[3, 5] = 1500, 2500
    lens = Intrinsics(fx=5.0, fy=7.0, cx=2.57, cy=1.69)  # no ray along an edge between voxels
    receipts = [
        client.insert_scan(lab, millimetres, scale_m=0.001),
        client.insert_scan(lab, doubles, compression="zstd", origin=(0.1, 0.2, 0.3)),
        client.insert_depth_image(lab, pixels, lens),
    ]
    assert [receipt.status for receipt in receipts] == ["applied"] * 3
    assert all(receipt.statistics for receipt in receipts)
    expected = OccupancyMap(0.1)
    expected.insert_scan(millimetres * 0.001)
    expected.insert_scan(doubles, origin=(0.1, 0.2, 0.3))
    expected.insert_scan(np.array([[-0.57 * 1.5 / 5, -0.69 * 1.5 / 7, 1.5], [2.43 * 2.5 / 5, 1.31 * 2.5 / 7, 2.5]]))
    copy = MapCopy()
    client.changes(lab, since=0).apply_to(copy)
    assert in_order(copied(copy)) == in_order(expected.leaves())


def test_a_subscribed_copy_equals_the_services_leaves_at_the_end(client: Client, lab: str) -> None:
    sent = scans(20)
    copy = MapCopy()
    applied = 0
    with client.stream(lab, subscribe=True) as stream:
        for scan in sent:
            stream.push_scan(scan)
        stream.flush()
        target = client.wait_applied(lab).revision
        while copy.revision < target:
            change = stream.next_change(timeout_s=5)
            assert change is not None
            change.apply_to(copy)
            applied += 1
        cleared = client.clear_box(lab, (-1, -1, -1), (1, 1, 1))
        while copy.revision < cleared.revision:
            change = stream.next_change(timeout_s=5)
            assert change is not None
            change.apply_to(copy)
            applied += 1
    assert applied > 1
    expected = mapped(sent)
    expected.clear_box((-1, -1, -1), (1, 1, 1))
    assert in_order(copied(copy)) == in_order(expected.leaves())


def test_changes_step_by_step_give_the_same_copy_as_the_whole_map(client: Client, lab: str) -> None:
    stepped, whole = MapCopy(), MapCopy()
    for scan in scans(8, seed=3):
        client.insert(lab, scan)
        client.changes(lab, since=stepped.revision).apply_to(stepped)
    client.changes(lab, since=0).apply_to(whole)
    for ours, theirs in zip(copied(stepped), copied(whole), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_queries_answer_as_the_kernel_does(client: Client, lab: str) -> None:
    sent = scans(6)
    client.upload_sequence(lab, sent, progress=False, wait="applied")
    expected = mapped(sent)
    random = np.random.default_rng(4)
    points = random.uniform(-4, 4, (2000, 3))
    occupancy = client.occupancy(lab, points)
    np.testing.assert_array_equal(occupancy.states, expected.states_at(points))
    np.testing.assert_array_equal(occupancy.log_odds, expected.log_odds_at(points))
    coarse = client.occupancy(lab, points, depth=13)
    np.testing.assert_array_equal(coarse.states, expected.states_at(points, depth=13))
    lo = points[:500]
    boxes = client.boxes(lab, lo, lo + 0.3)
    np.testing.assert_array_equal(boxes.states, expected.box_states(lo, lo + 0.3))
    directions = random.normal(size=(500, 3))
    hits = client.cast_rays(lab, [[0.0, 0.0, 0.0]], directions, max_range_m=5.0, unknown="occupied")
    wanted = expected.cast_rays(np.zeros((500, 3)), directions, 5.0, unknown="occupied")
    np.testing.assert_array_equal(hits.hit, wanted.hit)
    np.testing.assert_array_equal(hits.t_m, wanted.t_m)
    np.testing.assert_array_equal(hits.voxel, wanted.voxel)
    assert set(np.unique(hits.hit)) >= {1, 2}
    copy = MapCopy()
    client.changes(lab, since=0).apply_to(copy)
    np.testing.assert_array_equal(copy.log_odds_at(points), expected.log_odds_at(points))


@pytest.mark.parametrize("suffix", ["bt", "ot", "ply"])
def test_a_downloaded_map_is_the_kernels_own_export(client: Client, lab: str, tmp_path: Path, suffix: Suffix) -> None:
    sent = scans(3)
    client.upload_sequence(lab, sent, progress=False, wait="applied")
    assert client.download_map(lab, tmp_path / f"lab.{suffix}").read_bytes() == mapped(sent).export_bytes(suffix)


def test_maps_are_created_listed_and_deleted(client: Client) -> None:
    model = SensorModel(p_hit=0.8)
    info = client.create_map("made", 0.25, depth=18, sensor_model=model)
    assert (info.resolution_m, info.depth, info.sensor_model) == (0.25, 18, model)
    assert info in client.list_maps()
    assert client.create_map("made", 0.25, depth=18, sensor_model=model, exist_ok=True) == info
    with pytest.raises(MapExistsError):
        client.create_map("made", 0.25)
    assert client.map_info("made", statistics=True).statistics is not None
    client.delete_map("made")
    with pytest.raises(MapNotFoundError):
        client.map_info("made")


def test_the_services_refusals_are_typed(client: Client, lab: str) -> None:
    with pytest.raises(InvalidMapNameError):
        client.create_map("..hidden", 0.1)
    with pytest.raises(MapNotFoundError):
        client.insert("nowhere", scans(1)[0])
    with pytest.raises(OutOfRangeError):
        client.insert_scan(lab, [[1e6, 0.0, 0.0]])
    with pytest.raises(TooLargeError):
        client.insert_scan(lab, np.ones((200_001, 3), np.float32))
    with pytest.raises(ServiceTimeoutError):
        client.occupancy(lab, [[0.0, 0.0, 0.0]], min_revision=10_000)
    scan = scans(1)[0]
    client.insert(lab, scan)
    with pytest.raises(ScanConflictError):
        client.insert_scan(lab, [[1.0, 0.0, 0.0]], scan_id=scan.scan_id)
    assert client.map_info(lab).scans_acknowledged == 1


def test_a_refused_scan_in_a_stream_leaves_the_others(client: Client, lab: str) -> None:
    good = scans(3)
    far = Scan([[1e6, 0.0, 0.0]])
    report = client.upload_sequence(lab, [good[0], far, *good[1:]], progress=False, skip_refused=True, wait="applied")
    assert report.scans == 3
    assert [(refused.scan_id, type(refused.error)) for refused in report.refused] == [(far.scan_id, OutOfRangeError)]
    with pytest.raises(OutOfRangeError):
        client.upload_sequence(lab, [far], progress=False)


def test_a_wrong_key_is_refused_over_http_and_stream(url: str, lab: str) -> None:
    stranger = Client(url, "wrong")
    assert stranger.health() == "ok"
    with pytest.raises(UnauthorizedError):
        stranger.list_maps()
    with pytest.raises(UnauthorizedError), stranger.stream(lab):
        pass
    with pytest.raises(RayvoxClientError):
        Client(url, None).map_info(lab)


def test_the_async_client_does_all_of_it_at_once(url: str, lab: str) -> None:
    sent = scans(10)

    async def follow(client: AsyncClient) -> MapCopy:
        copy = MapCopy()
        async with client.subscribe(lab) as changes:
            async for change in changes:
                change.apply_to(copy)
                if (await client.map_info(lab)).scans_applied == 10 and copy.revision == 10:
                    break
        return copy

    async def upload(client: AsyncClient) -> None:
        async with client.stream(lab) as stream:
            for scan in sent[:5]:
                await stream.push_scan(scan)
        await client.upload_sequence(lab, sent[5:], progress=False, via="http")

    async def both() -> MapCopy:
        async with AsyncClient(url, KEY) as client:
            copy, _ = await asyncio.gather(follow(client), upload(client))
            return copy

    assert in_order(copied(asyncio.run(both()))) == in_order(mapped(sent).leaves())


def test_a_depth_scan_streams_like_any_other(client: Client, lab: str) -> None:
    pixels = np.full((8, 8), 1000, np.uint16)
    with client.stream(lab) as stream:
        stream.push_scan(DepthScan(pixels, Intrinsics(10, 10, 3.5, 3.5)))
    client.wait_applied(lab, stream.last_sequence)
    assert client.occupancy(lab, [[0.0, 0.0, 1.0]]).occupied.all()
