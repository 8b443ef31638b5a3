"""When readers wait for the writer, and when a map is copied for them."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
import rayvox
from rayvox_service.published_map import READ_AHEAD, PublishedMap


def change(published: PublishedMap) -> None:
    published.begin().insert_scan([[1.0, 0.0, 0.0]])


@pytest.fixture
def published() -> PublishedMap:
    return PublishedMap(rayvox.OccupancyMap(0.1))


def test_a_reader_of_a_map_that_is_read_gets_the_last_state_while_the_next_is_made(published: PublishedMap) -> None:
    assert published.snapshot().revision == 0
    for revision in range(5):
        change(published)
        assert published.snapshot().revision == revision
        published.publish()
        assert published.snapshot().revision == revision + 1


def test_the_first_reader_waits_for_a_change_under_way_and_gets_the_state_after_it(published: PublishedMap) -> None:
    change(published)
    asking = threading.Event()

    def read() -> int:
        asking.set()
        return published.snapshot().revision

    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(read)
        asking.wait()
        published.publish()
        assert answer.result(30) == 1


def test_who_follows_the_changes_does_not_keep_a_map_ready(published: PublishedMap) -> None:
    change(published)
    published.publish()
    assert published.snapshot(keep_ready=False).revision == 1
    assert not published.is_being_read


def test_a_map_that_nobody_reads_any_more_is_no_longer_kept_ready(published: PublishedMap) -> None:
    published.snapshot()
    for _ in range(READ_AHEAD):
        assert published.is_being_read
        change(published)
        published.publish()
    assert not published.is_being_read
