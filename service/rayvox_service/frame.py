"""The rayvox frame (docs/frame.md): one JSON header and 64-byte aligned raw payloads under one CRC-32C.

Decoding never copies a raw payload and never allocates from a number that was not checked against the limits and
against the bytes that are really there.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import google_crc32c
import numpy as np
import numpy.typing as npt
import zstandard

MAGIC = b"RVX1"
PREFIX = struct.Struct("<4sIQII")
ALIGNMENT = 64
MEDIA_TYPE = "application/vnd.rayvox.frame"
DTYPES = ("<f4", "<f8", "<i2", "<i4", "<i8", "<u2", "<u4", "|u1")
MAX_HEADER_BYTES = 1 << 18
MAX_PAYLOADS = 32
CRC_START = 24

PAYLOAD_KEYS = {"name", "dtype", "shape", "offset", "nbytes", "encoding"}

AnyArray = npt.NDArray[Any]
Bytes = bytes | bytearray | memoryview


class FrameError(ValueError):
    """The bytes are no valid frame, or do not have the fields that their kind needs."""


class FrameTooLargeError(FrameError):
    """The frame, or what it would expand to, is over the receiver's limits."""


@dataclass(frozen=True, slots=True)
class FrameLimits:
    """What a reader accepts: bytes of the frame itself, and of all payloads once expanded."""

    max_frame_bytes: int
    max_expanded_bytes: int


UNLIMITED = FrameLimits(1 << 62, 1 << 62)


@dataclass(frozen=True, slots=True)
class Payload:
    """Where one array lies in the frame; nothing is expanded before `Frame.array` asks for it."""

    name: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    offset: int
    nbytes: int
    encoding: str

    @property
    def expanded_bytes(self) -> int:
        return math.prod(self.shape) * self.dtype.itemsize


@dataclass(frozen=True, slots=True)
class Frame:
    """A checked frame. `crc32c` and `nbytes` identify its bytes."""

    kind: str
    fields: dict[str, Any]
    payloads: dict[str, Payload]
    crc32c: int
    nbytes: int
    _octets: npt.NDArray[np.uint8]

    def array(self, name: str) -> AnyArray:
        """The payload as a read-only array: a view of the frame where it is raw. FrameError where absent or corrupt."""
        payload = self.payloads.get(name)
        if payload is None:
            raise FrameError(f"a {self.kind} frame needs a payload named {name!r}")
        stored = self._octets[payload.offset : payload.offset + payload.nbytes]
        if payload.encoding == "zstd":
            stored = _expand(stored, payload)
        return stored.view(payload.dtype).reshape(payload.shape)


def crc32c(octets: npt.NDArray[np.uint8], crc: int = 0) -> int:
    """CRC-32C of contiguous octets, continuing from `crc`."""
    octets = octets.view()
    # google_crc32c accepts only buffers that promise not to change.
    octets.flags.writeable = False
    return int(google_crc32c.extend(crc, octets))


def decode_frame(data: Bytes, limits: FrameLimits) -> Frame:
    """Check `data` as exactly one frame. Raises FrameTooLargeError over a limit, FrameError for anything else wrong."""
    size = len(data)
    if size > limits.max_frame_bytes:
        raise FrameTooLargeError(f"the frame has {size} bytes, the limit is {limits.max_frame_bytes}")
    if size < PREFIX.size:
        raise FrameError(f"a frame has at least {PREFIX.size} bytes, this one has {size}")
    magic, header_bytes, frame_bytes, crc, reserved = PREFIX.unpack_from(data)
    if magic != MAGIC:
        raise FrameError(f"the frame starts with {bytes(magic)!r} instead of {MAGIC!r}")
    if reserved != 0:
        raise FrameError("the frame's reserved field is not 0")
    if frame_bytes != size:
        raise FrameError(f"the frame says {frame_bytes} bytes, but {size} arrived")
    if header_bytes > MAX_HEADER_BYTES or CRC_START + header_bytes > size:
        raise FrameError(f"the header's length {header_bytes} leaves the frame or is over {MAX_HEADER_BYTES}")
    octets = np.frombuffer(data, np.uint8)
    if crc32c(octets[CRC_START:]) != crc:
        raise FrameError("the frame's CRC-32C does not match its bytes")
    header = _parse_header(bytes(data[CRC_START : CRC_START + header_bytes]))
    kind, listed = header.pop("kind", None), header.pop("payloads", None)
    if not isinstance(kind, str) or not isinstance(listed, list):
        raise FrameError("the header needs a string 'kind' and a list 'payloads'")
    if len(listed) > MAX_PAYLOADS:
        raise FrameError(f"the header lists {len(listed)} payloads, the limit is {MAX_PAYLOADS}")
    payloads = [_parse_payload(entry) for entry in listed]
    _check_layout(payloads, octets, CRC_START + header_bytes, limits)
    return Frame(kind, header, {p.name: p for p in payloads}, crc, size, octets)


def encode_frame(kind: str, fields: Mapping[str, Any], arrays: Mapping[str, AnyArray], *, zstd: bool = False) -> bytes:
    """One frame as bytes. Arrays are stored little-endian and C-contiguous, in the mapping's order."""
    return b"".join(encode_frame_parts(kind, fields, arrays, zstd=zstd))


def encode_frame_parts(
    kind: str, fields: Mapping[str, Any], arrays: Mapping[str, AnyArray], *, zstd: bool = False
) -> list[Bytes]:
    """The frame as buffers to be written one after the other, so that large payloads are not copied together."""
    stored = {name: _store(array, zstd) for name, array in arrays.items()}
    header, offsets = _fit_header(kind, fields, arrays, {name: len(octets) for name, octets in stored.items()}, zstd)
    parts: list[npt.NDArray[np.uint8]] = []
    position = CRC_START
    for octets, offset in [(np.frombuffer(header, np.uint8), CRC_START), *zip(stored.values(), offsets, strict=True)]:
        parts += [np.zeros(offset - position, np.uint8), octets]
        position = offset + len(octets)
    if not offsets:
        parts.append(np.zeros(_aligned(position) - position, np.uint8))
        position = _aligned(position)
    crc = 0
    for part in parts:
        crc = crc32c(part, crc)
    return [PREFIX.pack(MAGIC, len(header), position, crc, 0), *(part.data for part in parts if len(part))]


def _aligned(position: int) -> int:
    return -(-position // ALIGNMENT) * ALIGNMENT


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not JSON")


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


def _parse_header(text: bytes) -> dict[str, Any]:
    try:
        header = _DECODER.decode(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise FrameError(f"the header is not JSON: {error}") from None
    if not isinstance(header, dict):
        raise FrameError("the header is not a JSON object")
    return header


def _is_count(value: object) -> bool:
    return type(value) is int and 0 <= value < 1 << 62


def _parse_payload(entry: object) -> Payload:
    if not isinstance(entry, dict) or not entry.keys() >= PAYLOAD_KEYS:
        raise FrameError(f"a payload is described by {sorted(PAYLOAD_KEYS)}")
    name, shape = entry["name"], entry["shape"]
    if not isinstance(name, str) or entry["dtype"] not in DTYPES or entry["encoding"] not in ("raw", "zstd"):
        raise FrameError(f"payload {name!r}: dtype must be one of {', '.join(DTYPES)}, encoding raw or zstd")
    if not isinstance(shape, list) or not 1 <= len(shape) <= 4 or not all(_is_count(n) for n in shape):
        raise FrameError(f"payload {name!r}: shape must be 1 to 4 counts")
    if not _is_count(entry["offset"]) or not _is_count(entry["nbytes"]):
        raise FrameError(f"payload {name!r}: offset and nbytes must be counts")
    dtype = np.dtype(entry["dtype"])
    return Payload(name, dtype, tuple(shape), entry["offset"], entry["nbytes"], entry["encoding"])


def _check_layout(payloads: list[Payload], octets: npt.NDArray[np.uint8], header_end: int, limits: FrameLimits) -> None:
    expanded = sum(payload.expanded_bytes for payload in payloads)
    if expanded > limits.max_expanded_bytes:
        raise FrameTooLargeError(f"the payloads expand to {expanded} bytes, the limit is {limits.max_expanded_bytes}")
    if len({payload.name for payload in payloads}) != len(payloads):
        raise FrameError("two payloads have the same name")
    position = header_end
    for payload in payloads:
        if payload.offset != _aligned(position) or payload.offset + payload.nbytes > len(octets):
            raise FrameError(f"payload {payload.name!r} overlaps, leaves the frame or does not start at the next 64")
        if payload.encoding == "raw" and payload.nbytes != payload.expanded_bytes:
            raise FrameError(
                f"payload {payload.name!r}: {payload.nbytes} bytes, but its shape needs {payload.expanded_bytes}"
            )
        _check_gap(octets[position : payload.offset])
        position = payload.offset + payload.nbytes
    end = position if payloads else _aligned(position)
    if len(octets) != end:
        raise FrameError(f"the frame has {len(octets)} bytes, but its last payload ends at {end}")
    _check_gap(octets[position:end])


def _check_gap(gap: npt.NDArray[np.uint8]) -> None:
    if gap.tobytes().strip(b"\0"):
        raise FrameError("a gap between payloads is not filled with zero bytes")


def _expand(stored: npt.NDArray[np.uint8], payload: Payload) -> npt.NDArray[np.uint8]:
    expected = payload.expanded_bytes
    try:
        # zstandard allocates what the compressed stream claims, so the claim is checked first.
        claimed = zstandard.frame_content_size(stored.data) if payload.nbytes else -1
        if claimed not in (-1, expected):
            raise FrameError(f"payload {payload.name!r} would expand to {claimed} bytes, its shape needs {expected}")
        expander = zstandard.ZstdDecompressor()
        data = expander.decompress(stored.data, max_output_size=expected, allow_extra_data=False) if expected else b""
    except zstandard.ZstdError as error:
        raise FrameError(f"payload {payload.name!r} is not zstd of {expected} bytes: {error}") from None
    if len(data) != expected:
        raise FrameError(f"payload {payload.name!r} expands to {len(data)} bytes, its shape needs {expected}")
    return np.frombuffer(data, np.uint8)


def _store(array: AnyArray, zstd: bool) -> npt.NDArray[np.uint8]:
    if array.dtype.str not in DTYPES:
        raise FrameError(f"dtype {array.dtype.str} cannot be stored in a frame")
    octets = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    return np.frombuffer(zstandard.ZstdCompressor().compress(octets.data), np.uint8) if zstd else octets


def _fit_header(
    kind: str, fields: Mapping[str, Any], arrays: Mapping[str, AnyArray], stored: Mapping[str, int], zstd: bool
) -> tuple[bytes, list[int]]:
    """Header text and payload offsets; offsets are part of the text, so its length is settled by repetition."""
    header, offsets = b"", [0] * len(stored)
    while True:
        entries = [
            {
                "name": name,
                "dtype": array.dtype.str,
                "shape": list(array.shape),
                "offset": offset,
                "nbytes": stored[name],
                "encoding": "zstd" if zstd else "raw",
            }
            for (name, array), offset in zip(arrays.items(), offsets, strict=True)
        ]
        document = {"kind": kind, **fields, "payloads": entries}
        header = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        fitted, position = [], CRC_START + len(header)
        for nbytes in stored.values():
            fitted.append(_aligned(position))
            position = fitted[-1] + nbytes
        if fitted == offsets:
            return header, offsets
        offsets = fitted
