from __future__ import annotations

import threading

import pytest
from rayvox_service.waiters import Waiters


def test_a_value_that_was_reached_is_there_at_once() -> None:
    assert Waiters(5).reached(5).result(0) == 5


def test_waiters_hear_of_their_value_and_not_before() -> None:
    waiters = Waiters(0)
    futures = {value: waiters.reached(value) for value in (3, 1, 2, 2)}
    waiters.advance(1)
    assert futures[1].result(0) == 1
    assert not futures[2].done()
    waiters.advance(3)
    assert futures[2].result(0) == futures[3].result(0) == 3


def test_a_waiter_that_gave_up_disturbs_nobody() -> None:
    waiters = Waiters(0)
    gone, there = waiters.reached(1), waiters.reached(1)
    gone.cancel()
    waiters.advance(1)
    assert there.result(0) == 1


def test_a_failure_reaches_all_now_and_later() -> None:
    waiters = Waiters(0)
    waiting = waiters.reached(1)
    waiters.fail(KeyError("gone"))
    for future in (waiting, waiters.reached(1), waiters.reached(0)):
        with pytest.raises(KeyError):
            future.result(0)


def test_no_waiter_is_missed_while_the_counter_runs() -> None:
    waiters = Waiters(0)

    def run() -> None:
        for value in range(1, 2001):
            waiters.advance(value)

    runner = threading.Thread(target=run)
    runner.start()
    results = [waiters.reached(value).result(20) for value in range(1, 2001)]
    runner.join()
    assert all(result >= value for value, result in enumerate(results, 1))
