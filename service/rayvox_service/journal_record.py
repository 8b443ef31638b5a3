"""One journal record: a small header, then the frame as it arrived.

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `RVXJ` |
| 4 | u32 | CRC-32C of the 16 bytes that follow and of the frame's first 24 bytes |
| 8 | u64 | sequence, 1 for the map's first record, without gaps |
| 16 | u64 | frame_bytes |
| 24 | bytes | the frame |

The frame's own CRC covers everything after its first 24 bytes, so together every byte is covered once and a scan
is not summed twice on its way to the disk.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass

import google_crc32c

from rayvox_service.frame import PREFIX, UNLIMITED, Bytes, Frame, FrameError, decode_frame

MAGIC = b"RVXJ"
RECORD = struct.Struct("<4sIQQ")
_COVERED = struct.Struct("<QQ")


class BadRecordError(Exception):
    """The bytes at this place are no record. `torn`: the file just ends too early, as after a crash."""

    def __init__(self, reason: str, torn: bool) -> None:
        super().__init__(reason)
        self.torn = torn


@dataclass(frozen=True, slots=True)
class Record:
    """A record that was read back; `frame` is None where it was only stepped over."""

    sequence: int
    end: int
    frame: Frame | None


def record_header(sequence: int, frame: Bytes) -> bytes:
    covered = _COVERED.pack(sequence, len(frame))
    return MAGIC + struct.pack("<I", _header_crc(covered, bytes(frame[: PREFIX.size]))) + covered


def read_record(descriptor: int, position: int, size: int, skip_through: int) -> Record:
    """The record at `position` of a file of `size` bytes. Payloads up to sequence `skip_through` are not read.

    Raises BadRecordError.
    """
    head = os.pread(descriptor, RECORD.size + PREFIX.size, position)
    if len(head) < RECORD.size + PREFIX.size:
        raise BadRecordError("the file ends within a record's header", torn=True)
    magic, crc, sequence, frame_bytes = RECORD.unpack_from(head)
    if magic != MAGIC:
        raise BadRecordError("a record does not start with its magic", torn=False)
    if crc != _header_crc(head[8 : RECORD.size], head[RECORD.size :]):
        raise BadRecordError("a record's header has a wrong CRC", torn=False)
    start, end = position + RECORD.size, position + RECORD.size + frame_bytes
    if end > size:
        raise BadRecordError(f"the file ends within record {sequence}", torn=True)
    if sequence <= skip_through:
        return Record(sequence, end, None)
    try:
        return Record(sequence, end, decode_frame(os.pread(descriptor, frame_bytes, start), UNLIMITED))
    except FrameError as error:
        raise BadRecordError(f"record {sequence} holds no valid frame: {error}", torn=False) from None


def _header_crc(covered: bytes, frame_prefix: bytes) -> int:
    return int(google_crc32c.value(covered + frame_prefix))
