"""Which scan ids a map has seen, with the sequence and the bytes they stood for."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rayvox_service.frame import AnyArray


@dataclass(frozen=True, slots=True)
class ScanEntry:
    """CRC-32C and length stand for the frame's bytes: enough to tell a retry from another scan under the same id."""

    sequence: int
    crc32c: int
    nbytes: int

    def same_bytes(self, crc32c: int, nbytes: int) -> bool:
        return (self.crc32c, self.nbytes) == (crc32c, nbytes)


class ScanLedger:
    """One writer; readers in any thread. An entry is two Python integers, about 200 bytes of memory per scan."""

    def __init__(self) -> None:
        self._packed: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._packed)

    def get(self, scan_id: uuid.UUID) -> ScanEntry | None:
        packed = self._packed.get(scan_id.int)
        return None if packed is None else _unpack(packed)

    def add(self, scan_id: uuid.UUID, entry: ScanEntry) -> None:
        self._packed[scan_id.int] = entry.sequence << 96 | entry.nbytes << 32 | entry.crc32c

    def to_arrays(self, through_sequence: int) -> dict[str, AnyArray]:
        """Entries up to a sequence as frame payloads: scan_ids (n,16), scan_sequences, scan_nbytes, scan_crc32c (n)."""
        # dict.copy is one step under the interpreter lock, iteration is not.
        entries = [(key, _unpack(packed)) for key, packed in self._packed.copy().items()]
        entries = [(key, entry) for key, entry in entries if entry.sequence <= through_sequence]
        ids = b"".join(key.to_bytes(16, "big") for key, _ in entries)
        return {
            "scan_ids": np.frombuffer(ids, np.uint8).reshape(-1, 16),
            "scan_sequences": np.array([entry.sequence for _, entry in entries], "<i8"),
            "scan_nbytes": np.array([entry.nbytes for _, entry in entries], "<i8"),
            "scan_crc32c": np.array([entry.crc32c for _, entry in entries], "<u4"),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, AnyArray]) -> ScanLedger:
        ledger = cls()
        ids = arrays["scan_ids"].tobytes()
        rows = zip(*(arrays[name].tolist() for name in ("scan_sequences", "scan_nbytes", "scan_crc32c")), strict=True)
        for index, (sequence, nbytes, crc) in enumerate(rows):
            scan_id = uuid.UUID(bytes=ids[16 * index : 16 * index + 16])
            ledger.add(scan_id, ScanEntry(sequence, crc, nbytes))
        return ledger


def _unpack(packed: int) -> ScanEntry:
    return ScanEntry(packed >> 96, packed & 0xFFFFFFFF, packed >> 32 & 0xFFFFFFFFFFFFFFFF)
