from __future__ import annotations

import errno
import os
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rayvox import OccupancyMap
from rayvox_service.hosted_map import HostedMap, MapOpenError
from rayvox_service.journal import list_segments
from rayvox_service.map_config import MapConfig, write_map_config
from rayvox_service.problems import Problem
from rayvox_service.settings import Settings
from rayvox_service.submission import Receipt, Submission, Wait
from rayvox_service.submission_check import SubmissionCheck

from tests.support.service_process import leaf_dict, scan_frame, some_points

RESOLUTION_M = 0.25
STOPPING = Problem("unavailable", "the test is over")
Opener = Callable[..., HostedMap]


@pytest.fixture
def open_map(tmp_path: Path) -> Iterator[Opener]:
    """Opens the map of one directory again and again, closing the one before."""
    opened: list[HostedMap] = []
    config = MapConfig(name="lab", resolution_m=RESOLUTION_M)
    write_map_config(tmp_path, config)

    def open_again(**changes: Any) -> HostedMap:
        if opened:
            opened.pop().close(STOPPING, drain=True)
        settings = Settings(data_dir=tmp_path, **{"fsync": False, **changes})
        opened.append(HostedMap(tmp_path, config, settings))
        return opened[-1]

    yield open_again
    for hosted in opened:
        hosted.close(STOPPING, drain=True)


def insert(hosted: HostedMap, seed: int, scan_id: uuid.UUID | None = None) -> Receipt:
    scan_id, data = scan_frame(some_points(seed), scan_id)
    return hosted.writer.submit_scan(data, scan_id).applied.result(20)


def leaves(hosted: HostedMap) -> dict[tuple[int, ...], float]:
    return leaf_dict(*hosted.snapshot().leaves())


def expected_leaves(seeds: list[int]) -> dict[tuple[int, ...], float]:
    occupancy_map = OccupancyMap(RESOLUTION_M)
    for seed in seeds:
        occupancy_map.insert_scan(some_points(seed))
    return leaf_dict(*occupancy_map.leaves())


def files(directory: Path, suffix: str) -> list[str]:
    return sorted(path.name for path in directory.glob(f"*{suffix}"))


def test_a_scan_is_in_the_map_with_what_the_kernel_says_about_it(open_map: Opener) -> None:
    hosted = open_map()
    receipt = insert(hosted, 1)
    assert (receipt.sequence, receipt.status, receipt.revision, receipt.duplicate) == (1, "applied", 1, False)
    assert receipt.statistics is not None
    assert receipt.statistics["ray_count"] == 200
    assert leaves(hosted) == expected_leaves([1])


@pytest.mark.parametrize("engine", ["dda", "embree"])
def test_the_engine_that_was_set_inserts_and_its_receipt_says_so(open_map: Opener, engine: str) -> None:
    pytest.importorskip("embreex" if engine == "embree" else "rayvox")
    hosted = open_map(engine=engine)
    receipt = insert(hosted, 1)
    assert receipt.statistics is not None
    assert receipt.statistics["engine"] == engine
    assert (receipt.statistics["bvh_node_count"] > 0) == (engine == "embree")
    stages = [receipt.statistics[name] for name in ("bvh_s", "cut_s", "shoot_s", "update_s")]
    assert 0 < sum(stages) <= receipt.statistics["total_s"]
    assert receipt.statistics["voxel_steps"] > 0
    assert receipt.statistics["voxels_changed"] > 0
    assert leaves(hosted) == expected_leaves([1])


def test_a_reopened_map_equals_the_one_that_was_closed(open_map: Opener) -> None:
    hosted = open_map()
    for seed in range(5):
        insert(hosted, seed)
    hosted.writer.submit_clear((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)).applied.result(20)
    insert(hosted, 5)
    before, revision = leaves(hosted), hosted.published.revision
    again = open_map()
    assert leaves(again) == before
    assert again.published.revision == revision
    assert again.info()["scans_acknowledged"] == again.info()["scans_applied"] == 6
    assert again.info()["last_sequence"] == 7


def test_a_retry_is_answered_with_the_first_scans_sequence(open_map: Opener) -> None:
    hosted = open_map()
    scan_id = uuid.uuid4()
    insert(hosted, 1, scan_id)
    insert(hosted, 2)
    retry = insert(hosted, 1, scan_id)
    assert (retry.duplicate, retry.sequence, retry.status) == (True, 1, "applied")
    assert leaves(hosted) == expected_leaves([1, 2])


def test_retries_that_arrive_together_are_journaled_once(open_map: Opener) -> None:
    hosted = open_map()
    _scan_id, data = scan_frame(some_points(1))
    receipts = [submission.applied.result(20) for submission in [hosted.writer.submit_scan(data) for _ in range(20)]]
    assert sorted(receipt.duplicate for receipt in receipts) == [False] + [True] * 19
    assert {receipt.sequence for receipt in receipts} == {1}
    assert hosted.info()["queue_bytes"] == 0
    assert leaves(hosted) == expected_leaves([1])


def test_the_same_id_with_other_bytes_is_a_conflict_even_while_the_first_is_on_its_way(open_map: Opener) -> None:
    hosted = open_map()
    scan_id, data = scan_frame(some_points(1))
    _, other = scan_frame(some_points(2), scan_id)
    submissions = [hosted.writer.submit_scan(data), hosted.writer.submit_scan(other)]
    assert submissions[0].applied.result(20).sequence == 1
    with pytest.raises(Problem) as caught:
        submissions[1].applied.result(20)
    assert caught.value.slug == "scan-conflict"


def test_retries_and_conflicts_are_known_after_a_restart(open_map: Opener) -> None:
    scan_id = uuid.uuid4()
    insert(open_map(), 1, scan_id)
    again = open_map()
    retry = insert(again, 1, scan_id)
    assert (retry.duplicate, retry.sequence, retry.status) == (True, 1, "applied")
    with pytest.raises(Problem, match="other bytes"):
        insert(again, 2, scan_id)
    assert leaves(again) == expected_leaves([1])


def test_compaction_leaves_one_snapshot_and_drops_what_it_holds_but_no_scans_id(
    open_map: Opener, tmp_path: Path
) -> None:
    hosted = open_map(snapshot_every_bytes=70_000)
    first = uuid.uuid4()
    insert(hosted, 0, first)
    for seed in range(1, 200):
        insert(hosted, seed)
    hosted = open_map(snapshot_every_bytes=70_000)
    assert len(files(tmp_path, ".snapshot")) == 1
    assert hosted.snapshot_sequence >= list_segments(tmp_path)[0].first_sequence - 1 > 0
    assert hosted.info()["scans_applied"] == 200
    assert insert(hosted, 0, first).duplicate
    with pytest.raises(Problem, match="other bytes"):
        insert(hosted, 999, first)
    assert leaves(hosted) == expected_leaves(list(range(200)))


def test_a_snapshot_that_cannot_be_read_is_not_silently_an_empty_map(open_map: Opener, tmp_path: Path) -> None:
    hosted = open_map(snapshot_every_bytes=70_000)
    for seed in range(200):
        insert(hosted, seed)
    hosted = open_map()
    hosted.close(STOPPING, drain=True)
    path = next(tmp_path.glob("*.snapshot"))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(MapOpenError):
        HostedMap(tmp_path, hosted.config, Settings(data_dir=tmp_path))


def test_a_cut_journal_is_said_in_the_maps_info(open_map: Opener, tmp_path: Path) -> None:
    hosted = open_map()
    for seed in range(3):
        insert(hosted, seed)
    assert hosted.info()["journal_cut"] is None
    hosted = open_map()
    hosted.close(STOPPING, drain=True)
    segment = list_segments(tmp_path)[-1].path
    os.truncate(segment, segment.stat().st_size - 1)
    again = HostedMap(tmp_path, hosted.config, Settings(data_dir=tmp_path))
    try:
        cut = again.info()["journal_cut"]
        assert cut["after_sequence"] == 2
        assert cut["bytes_cut"] > 0
        assert cut["segment"] == segment.name
        assert leaves(again) == expected_leaves([0, 1])
    finally:
        again.close(STOPPING, drain=True)


@pytest.mark.parametrize(
    ("points", "fields", "slug"),
    [
        (np.array([[np.nan, 0, 0]], "<f4"), {}, "invalid-input"),
        (np.array([[0, np.inf, 0]], "<f8"), {}, "invalid-input"),
        (np.zeros((0, 3), "<f4"), {}, "invalid-input"),
        (np.ones((5, 2), "<f4"), {}, "invalid-input"),
        (np.ones(3, "<f4"), {}, "invalid-input"),
        (np.ones((5, 3), "<i4"), {}, "invalid-input"),
        (np.ones((5, 3), "<i2"), {}, "invalid-input"),
        (np.ones((5, 3), "<i2"), {"scale_m": -1.0}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"T_map_sensor": [1.0] * 15}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"T_map_sensor": "identity"}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"T_map_sensor": (2 * np.eye(4)).ravel().tolist()}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"T_map_sensor": [10**400] * 16}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"origin": [0.0, 0.0]}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"max_range_m": -1.0}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"max_range_m": "far"}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"discretize": 1}, "invalid-input"),
        (np.ones((5, 3), "<f4"), {"scan_id": "none"}, "invalid-input"),
        (np.array([[1e6, 0, 0]], "<f8"), {}, "out-of-range"),
        (np.ones((2_000_001, 3), "<f4"), {}, "too-large"),
    ],
)
def test_a_bad_scan_changes_nothing_and_never_reaches_the_journal(
    open_map: Opener, tmp_path: Path, points: Any, fields: dict[str, Any], slug: str
) -> None:
    hosted = open_map()
    insert(hosted, 1)
    before = (leaves(hosted), hosted.info(), list_segments(tmp_path)[0].path.read_bytes())
    with pytest.raises(Problem) as caught:
        hosted.writer.submit_scan(scan_frame(points, **fields)[1]).applied.result(20)
    assert caught.value.slug == slug
    assert (leaves(hosted), hosted.info(), list_segments(tmp_path)[0].path.read_bytes()) == before


def test_a_bad_scan_does_not_stop_the_good_ones_beside_it(open_map: Opener) -> None:
    hosted = open_map()
    bad = scan_frame(np.full((4, 3), np.nan, "<f4"))[1]
    frames = [scan_frame(some_points(1))[1], bad, scan_frame(some_points(2))[1], b"no frame"]
    submissions = [hosted.writer.submit_scan(data) for data in frames]
    errors = [submission.applied.exception(20) for submission in submissions]
    assert [error.slug if isinstance(error, Problem) else None for error in errors] == [
        None,
        "invalid-input",
        None,
        "invalid-frame",
    ]
    assert leaves(hosted) == expected_leaves([1, 2])
    assert hosted.info()["queue_bytes"] == 0


class Gate:
    """Holds the kernel's insertion until it is opened."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.reached, self.opened = threading.Event(), threading.Event()
        self._insert = OccupancyMap.insert_prepared
        gate = self

        def insert_prepared(occupancy_map: OccupancyMap, *arguments: Any) -> Any:
            gate.reached.set()
            assert gate.opened.wait(20)
            return gate._insert(occupancy_map, *arguments)

        monkeypatch.setattr(OccupancyMap, "insert_prepared", insert_prepared)


def test_a_full_queue_refuses_and_takes_again_once_there_is_room(
    open_map: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = Gate(monkeypatch)
    hosted = open_map(queue_bytes=30_000)
    taken = []

    def submit_many() -> None:
        for seed in range(100):
            taken.append(hosted.writer.submit_scan(scan_frame(some_points(seed))[1]))

    with pytest.raises(Problem) as caught:
        submit_many()
    assert caught.value.slug == "overloaded"
    assert caught.value.headers["Retry-After"]
    assert 2 <= len(taken) < 20
    gate.opened.set()
    for submission in taken:
        submission.applied.result(20)
    assert hosted.info()["queue_bytes"] == 0
    insert(hosted, 1000)


def test_a_journaled_scan_is_acknowledged_before_it_is_applied(
    open_map: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = Gate(monkeypatch)
    hosted = open_map()
    submission = hosted.writer.submit_scan(scan_frame(some_points(1))[1])
    assert submission.journaled.result(20).status == "journaled"
    assert not submission.applied.done()
    assert hosted.published.revision == 0
    gate.opened.set()
    assert submission.applied.result(20).revision == 1


def test_readers_get_the_last_state_while_an_insertion_runs(open_map: Opener, monkeypatch: pytest.MonkeyPatch) -> None:
    hosted = open_map()
    insert(hosted, 1)
    before = leaves(hosted)
    gate = Gate(monkeypatch)
    submission = hosted.writer.submit_scan(scan_frame(some_points(2))[1])
    assert gate.reached.wait(20)
    assert leaves(hosted) == before
    gate.opened.set()
    submission.applied.result(20)
    assert leaves(hosted) == expected_leaves([1, 2])


def test_a_map_whose_sync_fails_under_a_running_insertion_goes_back_to_what_is_on_disk(
    open_map: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    hosted = open_map(fsync=True)
    insert(hosted, 1)
    inserted = threading.Event()
    real_insert, real_sync = OccupancyMap.insert_prepared, os.fdatasync

    def insert_prepared(occupancy_map: OccupancyMap, *arguments: Any) -> Any:
        result = real_insert(occupancy_map, *arguments)
        inserted.set()
        return result

    def fail_once(descriptor: int) -> None:
        assert inserted.wait(20)
        monkeypatch.setattr("rayvox_service.journal.os.fdatasync", real_sync)
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(OccupancyMap, "insert_prepared", insert_prepared)
    monkeypatch.setattr("rayvox_service.journal.os.fdatasync", fail_once)
    scan_id = uuid.uuid4()
    with pytest.raises(Problem) as caught:
        insert(hosted, 2, scan_id)
    assert caught.value.slug == "unavailable"
    assert insert(hosted, 3).sequence == 2
    assert leaves(hosted) == expected_leaves([1, 3])
    assert insert(hosted, 2, scan_id).duplicate is False
    revision = hosted.published.revision
    again = open_map()
    assert leaves(again) == expected_leaves([1, 3, 2])
    assert again.published.revision == revision == 3


def test_a_map_that_cannot_apply_a_journaled_record_says_so_and_takes_nothing_more(
    open_map: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    hosted = open_map()
    insert(hosted, 1)

    def fail(occupancy_map: OccupancyMap, *arguments: Any) -> Any:
        raise MemoryError

    with monkeypatch.context() as broken:
        broken.setattr(OccupancyMap, "insert_prepared", fail)
        with pytest.raises(Problem) as caught:
            insert(hosted, 2)
    assert caught.value.slug == "unavailable"
    with pytest.raises(Problem, match="could not be applied"):
        insert(hosted, 3)
    with pytest.raises(Problem, match="could not be applied"):
        hosted.snapshot()
    assert hosted.info()["state"] == "failed"
    assert leaves(open_map()) == expected_leaves([1, 2])


def test_closing_with_drain_finishes_what_was_taken(open_map: Opener) -> None:
    hosted = open_map()
    submissions = [hosted.writer.submit_scan(scan_frame(some_points(seed))[1]) for seed in range(10)]
    again = open_map()
    assert all(submission.applied.result(0).status == "applied" for submission in submissions)
    assert again.info()["scans_applied"] == 10
    with pytest.raises(Problem, match="the test is over"):
        hosted.writer.submit_scan(scan_frame(some_points(1))[1])


@settings(max_examples=15, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(["scan", "awaited scan", "clear", "bad"]), st.booleans()), min_size=1, max_size=30
    )
)
def test_records_are_applied_in_order_while_the_threads_swap_roles(submitted: list[tuple[str, bool]]) -> None:
    """Scans, clears and bad frames, each in a burst with the one before or after a pause; some are waited for."""
    expected, taken = OccupancyMap(RESOLUTION_M), list[Submission]()
    with tempfile.TemporaryDirectory() as folder:
        config = MapConfig(name="lab", resolution_m=RESOLUTION_M)
        hosted = HostedMap(Path(folder), config, Settings(data_dir=Path(folder), fsync=False))
        for seed, (kind, after_a_pause) in enumerate(submitted):
            if after_a_pause and taken:
                taken[-1].applied.result(20)
            if kind in ("scan", "awaited scan"):
                wait: Wait = "applied" if kind == "awaited scan" else "journaled"
                taken.append(hosted.writer.submit_scan(scan_frame(some_points(seed))[1], wait=wait))
                expected.insert_scan(some_points(seed))
            elif kind == "clear":
                taken.append(hosted.writer.submit_clear((-3.0, -3.0, -3.0), (1.0, 2.0, 3.0)))
                expected.clear_box((-3.0, -3.0, -3.0), (1.0, 2.0, 3.0))
            else:
                assert hosted.writer.submit_scan(b"no frame").applied.exception(20) is not None
        sequences = [submission.applied.result(20).sequence for submission in taken]
        assert sequences == list(range(1, len(taken) + 1))
        assert leaves(hosted) == leaf_dict(*expected.leaves())
        hosted.close(STOPPING, drain=True)


def test_a_scan_that_is_waited_for_is_inserted_by_the_thread_that_checked_it(
    open_map: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    hosted = open_map()
    checked, inserted = list[int](), list[int]()
    check, insert_prepared = SubmissionCheck.check, OccupancyMap.insert_prepared

    def noted_check(*arguments: Any) -> Any:
        checked.append(threading.get_ident())
        return check(*arguments)

    def noted_insert(*arguments: Any) -> Any:
        inserted.append(threading.get_ident())
        return insert_prepared(*arguments)

    monkeypatch.setattr(SubmissionCheck, "check", noted_check)
    monkeypatch.setattr(OccupancyMap, "insert_prepared", noted_insert)
    for seed in (1, 2):
        hosted.writer.submit_scan(scan_frame(some_points(seed))[1], wait="applied").applied.result(20)
    assert inserted[0] == checked[0] != checked[1]
