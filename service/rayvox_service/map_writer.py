"""The one way into a map: frames are checked, journaled, applied and acknowledged, in the order they came.

Two roles, played by two threads per map. *Intake* checks frames and writes all that wait to the journal under one
fdatasync. *Apply* inserts them into the map, already while the disk still writes; nothing is shown to readers or
acknowledged as applied before it is both on disk and in the map.

Where the sender waits for the insertion and nothing else is being applied, the threads swap roles: the one that checked
the scan goes straight on to insert it, and the other one wakes up to write it and to check what comes next.
"""

from __future__ import annotations

import logging
import threading
import uuid
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue

from rayvox import Engine, OccupancyMap

from rayvox_service import map_operation, scan
from rayvox_service.byte_budget import ByteBudget
from rayvox_service.frame import Bytes
from rayvox_service.journal import Journal
from rayvox_service.problems import Problem, as_problem
from rayvox_service.published_map import PublishedMap
from rayvox_service.scan_ledger import ScanEntry, ScanLedger
from rayvox_service.self_filter import RobotLookup, no_robots
from rayvox_service.submission import CommitGroup, Entry, Receipt, Submission, Wait
from rayvox_service.submission_check import SubmissionCheck, WriterLimits
from rayvox_service.waiters import Waiters, settle, settle_error

MAX_GROUP = 64
MAX_GROUP_BYTES = 64 << 20

log = logging.getLogger(__name__)

# One step of a thread's work; returns the next one, None at the end.
_Step = Callable[[], "_Step | None"]


@dataclass(frozen=True, slots=True)
class _Swap:
    """For the thread that applies: write these entries, which the other one goes on to insert, and be intake."""

    entries: list[Entry]


class MapWriter:
    """Thread-safe. `reload(sequence)` rebuilds the map from disk as it was right after that record.

    `on_applied(sequence, frame_bytes)` is called in the apply thread after each record and must not raise.
    """

    def __init__(
        self,
        published: PublishedMap,
        journal: Journal,
        ledger: ScanLedger,
        limits: WriterLimits,
        reload: Callable[[int], OccupancyMap],
        on_applied: Callable[[int, int], None],
        engine: Engine,
    ) -> None:
        self._published, self._journal, self._ledger = published, journal, ledger
        self._reload, self._on_applied = reload, on_applied
        self._engine: Engine = engine
        self._submission_check = SubmissionCheck(published, ledger, limits)
        self._lock = threading.Lock()
        self._budget = ByteBudget(limits.queue_bytes)
        self._closed: Problem | None = None
        self._broken: Problem | None = None
        self._inbox: SimpleQueue[Submission | None] = SimpleQueue()
        self._outbox: SimpleQueue[Entry | _Swap | None] = SimpleQueue()
        # Each is changed by one role only; equal when nothing is being applied.
        self._handed_over = self._applied_or_failed = 0
        self.last_sequence = journal.next_sequence - 1
        self.scans_applied = len(ledger)
        self.applied = Waiters(self.last_sequence)
        self.revision = Waiters(published.revision)
        self._threads = [
            threading.Thread(target=self._run, args=(step,), daemon=True)
            for step in (self._take_in, partial(self._apply_next, deque()))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def queued_bytes(self) -> int:
        return self._budget.used

    @property
    def broken(self) -> Problem | None:
        """Why the map takes nothing any more, None while it works."""
        return self._broken

    def check_room(self, nbytes: int) -> None:
        """Raises Problem overloaded when a frame of this size would not be taken now."""
        refusal = self._broken or self._closed
        if refusal is not None:
            raise refusal
        self._budget.check_room(nbytes)

    def submit_scan(
        self,
        data: Bytes,
        scan_id: uuid.UUID | None = None,
        wait: Wait = "journaled",
        find_robot: RobotLookup = no_robots,
    ) -> Submission:
        return self.submit(Submission(scan.KIND, data, scan_id, wait, find_robot))

    def submit_clear(self, lo: map_operation.Corner, hi: map_operation.Corner) -> Submission:
        return self.submit(Submission(map_operation.CLEAR_BOX, map_operation.clear_frame(lo, hi), None, wait="applied"))

    def close(self, refusal: Problem, *, drain: bool) -> None:
        """Refuse new frames, finish (`drain`) or refuse those that were taken, stop both threads. Once is enough."""
        with self._lock:
            if self._closed is not None:
                return
            self._closed = refusal
            if not drain:
                self._broken = self._broken or refusal
            self._inbox.put(None)
        for thread in self._threads:
            thread.join()
        # The owner's callbacks refer back to it: without this a deleted map would keep its memory until some later
        # garbage collection, which then stops everything for as long as freeing the octree takes.
        del self._reload, self._on_applied
        self.applied.fail(refusal)
        self.revision.fail(refusal)
        self._journal.close()

    def submit(self, submission: Submission) -> Submission:
        """Queue it. Raises Problem overloaded, or the reason why the map takes nothing any more."""
        # Under the lock, so that nothing is queued behind the mark that ends the threads.
        with self._lock:
            refusal = self._broken or self._closed
            if refusal is not None:
                raise refusal
            self._budget.take(submission)
            self._inbox.put(submission)
        return submission

    def _reject(self, submission: Submission, error: Exception) -> None:
        problem = as_problem(error)
        self._budget.release(submission)
        settle_error(submission.journaled, problem)
        settle_error(submission.applied, problem)

    @staticmethod
    def _run(first: _Step) -> None:
        # Between two steps nothing holds on to a scan.
        step: _Step | None = first
        while step is not None:
            step = step()

    # Intake

    def _take_in(self) -> _Step | None:
        submissions, closing = self._next_submissions()
        entries = self._check_all(submissions)
        for sequence, entry in enumerate(entries, self._journal.next_sequence):
            entry.sequence = sequence
        may_swap = self._handed_over == self._applied_or_failed and not closing
        self._handed_over += len(entries)
        if entries and may_swap and all(entry.submission.wait == "applied" for entry in entries):
            self._outbox.put(_Swap(entries))
            return partial(self._apply_next, deque(entries))
        # Insertion starts while the record is still being written; see _apply for when the disk refuses.
        for entry in entries:
            self._outbox.put(entry)
        if entries:
            self._commit(entries)
        if not closing:
            return self._take_in
        self._outbox.put(None)
        return None

    def _next_submissions(self) -> tuple[list[Submission], bool]:
        """All that wait, at least one; and whether the mark that ends the threads was among them."""
        waiting = [self._inbox.get()]
        try:
            while len(waiting) < MAX_GROUP and sum(len(s.data) for s in waiting if s) < MAX_GROUP_BYTES:
                waiting.append(self._inbox.get_nowait())
        except Empty:
            pass
        return [submission for submission in waiting if submission is not None], None in waiting

    def _check_all(self, submissions: list[Submission]) -> list[Entry]:
        group = CommitGroup()
        entries: list[Entry] = []
        for submission in submissions:
            try:
                if self._broken is not None:
                    raise self._broken
                taken = len(submission.data)
                found = self._submission_check.check(submission, group, entries)
                self._budget.change(submission, len(submission.data) - taken)
            except Exception as error:
                self._reject(submission, error)
                continue
            if isinstance(found, ScanEntry):
                self._answer_retry(submission, found.sequence)
            elif found.submission is submission:
                self._budget.change(submission, found.operation.nbytes)
                entries.append(found)
            else:
                found.retries.append(submission)
        return entries

    def _commit(self, entries: list[Entry]) -> None:
        group = entries[0].group
        try:
            self._journal.write([entry.submission.data for entry in entries])
            self._journal.sync()
            self._remember(entries)
        except Exception as error:
            group.failed = True
            for entry in entries:
                for submission in (entry.submission, *entry.retries):
                    self._reject(submission, error)
            return
        finally:
            group.settled.set()
        for entry in entries:
            receipt = Receipt(entry.submission.scan_id, entry.sequence, "journaled", None, False)
            settle(entry.submission.journaled, receipt)
            for retry in entry.retries:
                self._answer_retry(retry, entry.sequence)

    def _remember(self, entries: list[Entry]) -> None:
        for entry in entries:
            scan_id = entry.submission.scan_id
            if scan_id is not None:
                self._ledger.add(scan_id, ScanEntry(entry.sequence, entry.crc32c, entry.nbytes))
            self._budget.change(entry.submission, -len(entry.submission.data))
            entry.submission.data = b""
        self.last_sequence = entries[-1].sequence

    def _answer_retry(self, submission: Submission, sequence: int) -> None:
        def answer_applied(done: Future[int]) -> None:
            error = done.exception()
            if isinstance(error, Exception):
                settle_error(submission.applied, error)
            else:
                revision = self._published.revision
                settle(submission.applied, Receipt(submission.scan_id, sequence, "applied", revision, True))

        self._budget.release(submission)
        # Runs at once for a scan that is in the map already.
        self.applied.reached(sequence).add_done_callback(answer_applied)
        if submission.applied.done() and submission.applied.exception() is None:
            settle(submission.journaled, submission.applied.result())
        else:
            settle(submission.journaled, Receipt(submission.scan_id, sequence, "journaled", None, True))

    # Apply

    def _apply_next(self, own: deque[Entry]) -> _Step | None:
        """`own` are this thread's entries since a swap; only then come those of the outbox."""
        item = own.popleft() if own else self._outbox.get()
        if item is None:
            return None
        if isinstance(item, _Swap):
            self._commit(item.entries)
            return self._take_in
        try:
            if self._broken is not None:
                raise self._broken
            self._apply(item)
        except Exception as error:
            self._give_up(item, error)
        self._applied_or_failed += 1
        return partial(self._apply_next, own)

    def _apply(self, entry: Entry) -> None:
        if entry.group.failed:
            return
        outcome = entry.operation.apply(self._published.begin(), self._engine)
        entry.group.settled.wait()
        if entry.group.failed:
            # The map holds something that is not on disk, so a restart would show another map: go back to the disk's.
            self._published.publish(self._reload(self.applied.value))
            return
        self._published.publish()
        self.scans_applied += entry.submission.scan_id is not None
        # The bytes are given back before anybody hears of it: who waited for room finds it.
        self._budget.release(entry.submission)
        self.applied.advance(entry.sequence)
        self.revision.advance(outcome.revision)
        receipt = Receipt(
            entry.submission.scan_id, entry.sequence, "applied", outcome.revision, False, outcome.statistics
        )
        settle(entry.submission.applied, receipt)
        self._on_applied(entry.sequence, entry.nbytes)

    def _give_up(self, entry: Entry, error: Exception) -> None:
        # Skipping a journaled record would give another map than a restart does, so nothing is applied any more.
        if self._broken is None:
            log.error("record %d could not be applied", entry.sequence, exc_info=error)
            self._broken = Problem("unavailable", f"record {entry.sequence} could not be applied: {error}")
        self._published.fail(self._broken)
        self.applied.fail(self._broken)
        self.revision.fail(self._broken)
        settle_error(entry.submission.applied, self._broken)
        self._budget.release(entry.submission)
