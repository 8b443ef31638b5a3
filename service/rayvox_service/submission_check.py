"""From a submitted frame to something that may be journaled: decoded, of the right kind, not there yet, insertable."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass

from rayvox_service import scan, self_filter
from rayvox_service.frame import UNLIMITED, Frame, FrameLimits, decode_frame
from rayvox_service.map_config import InsertionConfig
from rayvox_service.map_operation import parse_operation
from rayvox_service.problems import Problem
from rayvox_service.published_map import PublishedMap
from rayvox_service.scan_ledger import ScanEntry, ScanLedger
from rayvox_service.submission import CommitGroup, Entry, Submission


@dataclass(frozen=True, slots=True)
class WriterLimits:
    """`queue_bytes` bounds frames and prepared scans that are not yet applied; `insertion` is the map's."""

    frame: FrameLimits
    max_points: int
    queue_bytes: int
    insertion: InsertionConfig


class SubmissionCheck:
    """Reads map and ledger, changes neither; a scan that is to be filtered is replaced by what goes into the map."""

    def __init__(self, published: PublishedMap, ledger: ScanLedger, limits: WriterLimits) -> None:
        self._published, self._ledger, self._limits = published, ledger, limits

    def check(self, submission: Submission, group: CommitGroup, earlier: Sequence[Entry]) -> Entry | ScanEntry:
        """A new entry; for a scan sent again the one among `earlier`, or the ledger's if that is journaled already.

        Raises FrameError, Problem or rayvox.InvalidInputError.
        """
        frame = decode_frame(submission.data, self._limits.frame)
        if frame.kind != submission.kind:
            raise Problem("invalid-input", f"a {submission.kind} frame is needed, this one is {frame.kind[:60]!r}")
        if frame.kind == scan.KIND:
            known = self._known(submission, frame, earlier)
            if known is not None:
                return known
        received = frame
        if self_filter.FIELD in frame.fields:
            submission.data = self_filter.without_own_body(frame, submission.find_robot, self._limits.max_points)
            frame = decode_frame(submission.data, UNLIMITED)
        limits = self._limits
        operation = parse_operation(frame, self._published.unchanging(), limits.insertion, limits.max_points)
        return Entry(submission, operation, group, received.crc32c, received.nbytes)

    def _known(self, submission: Submission, frame: Frame, earlier: Sequence[Entry]) -> Entry | ScanEntry | None:
        scan_id = scan.parse_scan_id(frame.fields.get("scan_id"))
        if submission.scan_id not in (None, scan_id):
            raise Problem("invalid-input", f"the frame's scan_id {scan_id} is not the address's {submission.scan_id}")
        submission.scan_id = scan_id
        journaled = self._ledger.get(scan_id)
        if journaled is not None:
            _refuse_other_bytes(journaled, frame, scan_id)
            return journaled
        for entry in earlier:
            if entry.submission.scan_id == scan_id:
                _refuse_other_bytes(ScanEntry(0, entry.crc32c, entry.nbytes), frame, scan_id)
                return entry
        return None


def _refuse_other_bytes(known: ScanEntry, frame: Frame, scan_id: uuid.UUID) -> None:
    if not known.same_bytes(frame.crc32c, frame.nbytes):
        raise Problem("scan-conflict", f"scan {scan_id} was sent before with other bytes", scan_id=str(scan_id))
