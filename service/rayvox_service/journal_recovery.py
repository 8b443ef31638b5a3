"""Reading a journal back after a stop of any kind, and cutting what a crash or a bad disk left at its end."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rayvox_service.durable_files import sync_directory
from rayvox_service.frame import Frame
from rayvox_service.journal import SEGMENT_HEADER, Segment, list_segments, segment_header
from rayvox_service.journal_record import BadRecordError, read_record

log = logging.getLogger(__name__)


class JournalGapError(Exception):
    """Records between the snapshot and the journal's first one are missing: the map cannot be rebuilt."""


@dataclass(frozen=True, slots=True)
class JournalCut:
    """What was cut off at start-up. `kept_as` names the files that still hold bytes that were not just torn."""

    segment: str
    at_byte: int
    bytes_cut: int
    after_sequence: int
    reason: str
    kept_as: list[str]


class JournalRecovery:
    """Iterate over the records behind `after_sequence` once, in order; then `cut()` what did not read.

    `through_sequence` ends the reading early, for a journal that somebody is still writing: never cut then.
    """

    def __init__(self, directory: Path, after_sequence: int, through_sequence: int | None = None) -> None:
        self._directory = directory
        self._after = after_sequence
        self._through = through_sequence
        self._segments = list_segments(directory)
        self._bad: tuple[int, int, BadRecordError] | None = None
        self.last_sequence = after_sequence
        self._last_read = self._segments[0].first_sequence - 1 if self._segments else after_sequence
        if self._last_read > after_sequence:
            raise JournalGapError(f"the journal starts at {self._last_read + 1}, needed is {after_sequence + 1}")

    def __iter__(self) -> Iterator[tuple[int, Frame]]:
        for index, segment in enumerate(self._segments):
            descriptor = os.open(segment.path, os.O_RDONLY)
            try:
                yield from self._read_segment(index, segment, descriptor)
            finally:
                os.close(descriptor)
            if self._bad is not None or self._done():
                return

    def _done(self) -> bool:
        return self._through is not None and self._last_read >= self._through

    def _read_segment(self, index: int, segment: Segment, descriptor: int) -> Iterator[tuple[int, Frame]]:
        size = os.fstat(descriptor).st_size
        position = 0
        try:
            _check_segment_header(descriptor, segment, self._last_read + 1)
            position = SEGMENT_HEADER.size
            while position < size and not self._done():
                record = read_record(descriptor, position, size, self._after)
                if record.sequence != self._last_read + 1:
                    raise BadRecordError(f"record {record.sequence} follows {self._last_read}", torn=False)
                position, self._last_read = record.end, record.sequence
                self.last_sequence = max(self.last_sequence, record.sequence)
                if record.frame is not None:
                    yield record.sequence, record.frame
        except BadRecordError as error:
            self._bad = (index, position, error)

    def cut(self) -> JournalCut | None:
        """Leave only what was read; None where all was. To be called once, before anything is appended."""
        if self._bad is None:
            self._retire_stale_segments()
            return None
        index, position, error = self._bad
        bad, later = self._segments[index], self._segments[index + 1 :]
        cut_bytes = sum(segment.path.stat().st_size for segment in [bad, *later]) - position
        kept = [_set_aside(segment.path) for segment in later]
        if not error.torn:
            kept.insert(0, _copy_aside(bad.path, position))
        if position <= SEGMENT_HEADER.size:
            bad.path.unlink()
        else:
            os.truncate(bad.path, position)
            descriptor = os.open(bad.path, os.O_RDWR)
            os.fsync(descriptor)
            os.close(descriptor)
        self._retire_stale_segments()
        sync_directory(self._directory)
        cut = JournalCut(bad.path.name, position, cut_bytes, self.last_sequence, str(error), kept)
        log.warning("journal %s cut at byte %d: %d bytes after record %d; %s", bad.path, position, cut_bytes,
                    self.last_sequence, error)  # fmt: skip
        return cut

    def _retire_stale_segments(self) -> None:
        # The snapshot is ahead of the whole journal: appending behind an older record would leave a gap.
        if self._last_read < self._after:
            for segment in list_segments(self._directory):
                segment.path.unlink()


def _check_segment_header(descriptor: int, segment: Segment, expected_sequence: int) -> None:
    head = os.pread(descriptor, SEGMENT_HEADER.size, 0)
    if len(head) < SEGMENT_HEADER.size:
        raise BadRecordError("the file ends within the segment's header", torn=True)
    if head != segment_header(segment.first_sequence):
        raise BadRecordError("the segment's header is damaged", torn=False)
    if segment.first_sequence != expected_sequence:
        raise BadRecordError(f"the segment starts at {segment.first_sequence}, not {expected_sequence}", torn=False)


def _set_aside(path: Path) -> str:
    target = path.with_name(path.name + ".cut")
    path.rename(target)
    return target.name


def _copy_aside(path: Path, position: int) -> str:
    target = path.with_name(f"{path.name}.{position}.cut")
    with path.open("rb") as source, target.open("wb") as copy:
        source.seek(position)
        while block := source.read(1 << 20):
            copy.write(block)
    return target.name
