"""One map of the service: its directory, kernel map, journal, snapshots and writer."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from pathlib import Path
from typing import Any

from rayvox import MapSnapshot, OccupancyMap, RayvoxError

from rayvox_service.journal import Journal
from rayvox_service.journal_recovery import JournalCut, JournalGapError, JournalRecovery
from rayvox_service.map_config import MapConfig
from rayvox_service.map_operation import ScanOperation, parse_operation
from rayvox_service.map_writer import MapWriter
from rayvox_service.problems import Problem
from rayvox_service.published_map import PublishedMap
from rayvox_service.scan_ledger import ScanEntry, ScanLedger
from rayvox_service.settings import Settings
from rayvox_service.snapshot_file import read_latest_snapshot, write_snapshot
from rayvox_service.submission_check import WriterLimits

MIN_SEGMENT_BYTES = 1 << 16

log = logging.getLogger(__name__)


class MapOpenError(Exception):
    """The map's directory cannot be turned into a map; nothing in it was changed."""


@dataclasses.dataclass(slots=True)
class _Restored:
    occupancy_map: OccupancyMap
    ledger: ScanLedger
    snapshot_sequence: int
    replayed_bytes: int


class HostedMap:
    """Open it once per directory. Reading and submitting are safe in any thread."""

    def __init__(self, directory: Path, config: MapConfig, settings: Settings) -> None:
        """Restore the map from snapshot and journal. Raises MapOpenError, OSError."""
        started = time.monotonic()
        self.config = config
        self._directory = directory
        self._snapshot_every_bytes = settings.snapshot_every_bytes
        self._engine = settings.engine
        self._snapshotting: threading.Thread | None = None
        restored, recovery = self._restore(None)
        self.journal_cut: JournalCut | None = recovery.cut()
        self._bytes_since_snapshot = restored.replayed_bytes
        self.snapshot_sequence = restored.snapshot_sequence
        self._ledger = restored.ledger
        self._journal = Journal(
            directory,
            recovery.last_sequence + 1,
            segment_bytes=max(MIN_SEGMENT_BYTES, settings.snapshot_every_bytes // 4),
            fsync=settings.fsync,
        )
        self.published = PublishedMap(restored.occupancy_map)
        self.writer = MapWriter(
            self.published,
            self._journal,
            self._ledger,
            WriterLimits(settings.frame_limits, settings.max_points, settings.queue_bytes, config.insertion),
            lambda sequence: self._restore(sequence)[0].occupancy_map,
            self._after_record,
            settings.engine,
        )
        log.info(
            "map %s open at record %d, revision %d, %d bytes replayed in %.2f s", config.name, recovery.last_sequence,
            self.published.revision, restored.replayed_bytes, time.monotonic() - started,
        )  # fmt: skip

    def snapshot(self) -> MapSnapshot:
        """The latest state that is applied and on disk. May wait for a running insertion."""
        return self.published.snapshot()

    def info(self) -> dict[str, Any]:
        """The MapInfo document without statistics. Walks the octree for its memory: not for the event loop's thread."""
        broken = self.writer.broken
        return {
            **self.config.model_dump(),
            "state": "open" if broken is None else "failed",
            "failure": None if broken is None else broken.detail,
            "revision": self.published.revision,
            "scans_acknowledged": len(self._ledger),
            "scans_applied": self.writer.scans_applied,
            "last_sequence": self.writer.last_sequence,
            "applied_sequence": self.writer.applied.value,
            "snapshot_sequence": self.snapshot_sequence,
            "queue_bytes": self.writer.queued_bytes,
            "memory_bytes": self.published.unchanging().nbytes,
            "journal_cut": None if self.journal_cut is None else dataclasses.asdict(self.journal_cut),
        }

    def close(self, refusal: Problem, *, drain: bool) -> None:
        self.writer.close(refusal, drain=drain)
        if self._snapshotting is not None:
            self._snapshotting.join()

    def _restore(self, through_sequence: int | None) -> tuple[_Restored, JournalRecovery]:
        if self._snapshotting is not None:
            self._snapshotting.join()
        try:
            stored = read_latest_snapshot(self._directory)
            if stored is None:
                restored = _Restored(self.config.new_map(), ScanLedger(), 0, 0)
            else:
                occupancy_map = self.config.restore_map(stored.nodes, stored.revision)
                restored = _Restored(occupancy_map, stored.ledger, stored.last_sequence, 0)
            recovery = JournalRecovery(self._directory, restored.snapshot_sequence, through_sequence)
            for sequence, frame in recovery:
                operation = parse_operation(frame, restored.occupancy_map, self.config.insertion)
                operation.apply(restored.occupancy_map, self._engine)
                if isinstance(operation, ScanOperation):
                    received = operation.received
                    restored.ledger.add(operation.scan_id, ScanEntry(sequence, received.crc32c, received.nbytes))
                restored.replayed_bytes += frame.nbytes
        except (JournalGapError, RayvoxError, Problem, ValueError) as error:
            raise MapOpenError(f"{self._directory}: {error}") from error
        return restored, recovery

    def _after_record(self, sequence: int, frame_bytes: int) -> None:
        self._bytes_since_snapshot += frame_bytes
        running = self._snapshotting is not None and self._snapshotting.is_alive()
        if self._bytes_since_snapshot < self._snapshot_every_bytes or running:
            return
        self._bytes_since_snapshot = 0
        arguments = (self.published.snapshot(), sequence)
        self._snapshotting = threading.Thread(target=self._write_snapshot, args=arguments, daemon=True)
        self._snapshotting.start()

    def _write_snapshot(self, snapshot: MapSnapshot, sequence: int) -> None:
        started = time.monotonic()
        try:
            nodes = snapshot.to_bytes()
            nbytes = write_snapshot(self._directory, sequence, snapshot.revision, nodes, self._ledger)
            self._journal.drop_through(sequence)
        except OSError as error:
            # The journal still holds everything; the next try comes after as many bytes again.
            log.error("map %s: no snapshot at record %d: %s", self.config.name, sequence, error)
            return
        self.snapshot_sequence = sequence
        log.info("map %s: snapshot at record %d, %d bytes, %.2f s", self.config.name, sequence, nbytes,
                 time.monotonic() - started)  # fmt: skip
