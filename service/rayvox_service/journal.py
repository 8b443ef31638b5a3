"""Append-only journal of one map: segments of records, each acknowledged only after it is on disk."""

from __future__ import annotations

import logging
import os
import struct
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import google_crc32c

from rayvox_service.durable_files import sync_directory, write_all
from rayvox_service.frame import Bytes
from rayvox_service.journal_record import record_header

SEGMENT_MAGIC = b"RVXJSEG1"
SEGMENT_HEADER = struct.Struct("<8sQII")
SUFFIX = ".journal"

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Segment:
    path: Path
    first_sequence: int


def segment_path(directory: Path, first_sequence: int) -> Path:
    return directory / f"{first_sequence:020d}{SUFFIX}"


def list_segments(directory: Path) -> list[Segment]:
    return [Segment(path, int(path.stem)) for path in sorted(directory.glob(f"{'[0-9]' * 20}{SUFFIX}"))]


def segment_header(first_sequence: int) -> bytes:
    body = SEGMENT_MAGIC + struct.pack("<Q", first_sequence)
    return body + struct.pack("<II", google_crc32c.value(body), 0)


class Journal:
    """The writing end; one thread writes and syncs, another may drop old segments.

    `write` puts records behind the last ones, `sync` makes them durable. Either leaves the journal as it was before
    when the disk refuses: what is not synced never stays behind.
    """

    def __init__(self, directory: Path, next_sequence: int, *, segment_bytes: int, fsync: bool) -> None:
        self._directory = directory
        self._segment_bytes = segment_bytes
        self._fsync = fsync
        self._lock = threading.Lock()
        self._segments = list_segments(directory)
        self._next_sequence = next_sequence
        self._descriptor = -1
        if self._segments:
            self._descriptor = os.open(self._segments[-1].path, os.O_RDWR)
            self._end = os.fstat(self._descriptor).st_size
        else:
            self._start_segment()
        self._synced_end, self._synced_next = self._end, next_sequence
        self._must_truncate = False

    @property
    def next_sequence(self) -> int:
        return self._next_sequence

    def nbytes(self) -> int:
        with self._lock:
            return sum(segment.path.stat().st_size for segment in self._segments)

    def write(self, frames: Sequence[Bytes]) -> int:
        """Append one record per frame; returns the first one's sequence. Raises OSError with nothing appended."""
        if self._must_truncate:
            self._roll_back()
        if self._end >= self._segment_bytes and self._end == self._synced_end:
            self._start_segment()
            self._synced_end = self._end
        first = self._next_sequence
        parts: list[Bytes] = []
        for offset, frame in enumerate(frames):
            parts += [record_header(first + offset, frame), frame]
        try:
            self._end = write_all(self._descriptor, parts, self._end)
        except OSError:
            self._roll_back()
            raise
        self._next_sequence = first + len(frames)
        return first

    def sync(self) -> None:
        """Make everything written durable. Raises OSError with everything since the last sync taken back."""
        if self._fsync:
            try:
                os.fdatasync(self._descriptor)
            except OSError:
                self._roll_back()
                raise
        self._synced_end, self._synced_next = self._end, self._next_sequence

    def drop_through(self, sequence: int) -> None:
        """Delete segments whose records all have a sequence up to `sequence`; the open segment stays."""
        with self._lock:
            followers = self._segments[1:]
            while followers and followers[0].first_sequence <= sequence + 1:
                self._segments[0].path.unlink()
                del self._segments[0], followers[0]
            sync_directory(self._directory)

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def _roll_back(self) -> None:
        # A record left behind could be taken for a valid one that nobody acknowledged, right after the next that is:
        # nothing more is written until the truncation has succeeded.
        self._must_truncate = True
        self._end, self._next_sequence = self._synced_end, self._synced_next
        os.ftruncate(self._descriptor, self._synced_end)
        self._must_truncate = False

    def _start_segment(self) -> None:
        segment = Segment(segment_path(self._directory, self._next_sequence), self._next_sequence)
        descriptor = os.open(segment.path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o644)
        try:
            end = write_all(descriptor, [segment_header(segment.first_sequence)], 0)
            os.fsync(descriptor)
            sync_directory(self._directory)
        except OSError:
            os.close(descriptor)
            segment.path.unlink(missing_ok=True)
            raise
        if self._descriptor >= 0:
            os.close(self._descriptor)
        with self._lock:
            self._segments.append(segment)
        self._descriptor, self._end = descriptor, end
