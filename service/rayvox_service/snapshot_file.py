"""Snapshots of one map's whole state on disk, each one frame of kind `snapshot`.

Fields: `last_sequence`, `revision`. Payloads: `nodes` (the kernel's own bytes) and the scan ledger's arrays.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rayvox_service.durable_files import sync_directory, write_file
from rayvox_service.frame import UNLIMITED, FrameError, decode_frame, encode_frame_parts
from rayvox_service.scan_ledger import ScanLedger

KIND = "snapshot"
SUFFIX = ".snapshot"
LEDGER_ARRAYS = ("scan_ids", "scan_sequences", "scan_nbytes", "scan_crc32c")

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class StoredState:
    """A map right after the record `last_sequence`."""

    last_sequence: int
    revision: int
    nodes: bytes
    ledger: ScanLedger


def write_snapshot(directory: Path, last_sequence: int, revision: int, nodes: bytes, ledger: ScanLedger) -> int:
    """Write the state durably, then delete older snapshots; returns its bytes. Raises OSError with nothing changed."""
    fields = {"last_sequence": last_sequence, "revision": revision}
    arrays = {"nodes": np.frombuffer(nodes, np.uint8), **ledger.to_arrays(last_sequence)}
    parts = encode_frame_parts(KIND, fields, arrays)
    path = directory / f"{last_sequence:020d}{SUFFIX}"
    write_file(path, parts)
    for older in _list(directory):
        if older.name < path.name:
            older.unlink()
    sync_directory(directory)
    return sum(len(part) for part in parts)


def read_latest_snapshot(directory: Path) -> StoredState | None:
    """The newest snapshot that reads back whole, or None. One that does not is logged and left where it is."""
    for path in reversed(_list(directory)):
        try:
            return _read(path)
        except (OSError, FrameError, KeyError, ValueError) as error:
            log.error("snapshot %s cannot be used: %s", path, error)
    return None


def _list(directory: Path) -> list[Path]:
    return sorted(directory.glob(f"{'[0-9]' * 20}{SUFFIX}"))


def _read(path: Path) -> StoredState:
    frame = decode_frame(path.read_bytes(), UNLIMITED)
    ledger = ScanLedger.from_arrays({name: frame.array(name) for name in LEDGER_ARRAYS})
    return StoredState(frame.fields["last_sequence"], frame.fields["revision"], frame.array("nodes").tobytes(), ledger)
