"""The binary frame: a checksummed JSON header followed by 64-byte aligned raw arrays.

The same bytes are an HTTP body and a WebSocket message. Nothing here does I/O.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any, Literal

import google_crc32c
import numpy as np
from numpy.typing import NDArray

from rayvox_client.errors import InvalidInputError, MalformedAnswerError
from rayvox_client.fields import Fields

MEDIA_TYPE = "application/vnd.rayvox.frame"
MAX_EXPANDED_BYTES = 4 << 30
Compression = Literal["zstd"] | None

_ENCODER = json.JSONEncoder(allow_nan=False, separators=(",", ":"), ensure_ascii=False)
_PREFIX = struct.Struct("<4sIQII")
_MAGIC = b"RVX1"
_ALIGNMENT = 64
_DTYPES = frozenset({"<f4", "<f8", "<i2", "<i4", "<i8", "<u2", "<u4", "|u1"})


@dataclass(frozen=True, eq=False)
class Frame:
    """A decoded frame.

    Attributes:
        kind: `scan`, `occupancy`, `hits`, `changes`, ...
        fields: the header's other fields.
        payloads: the arrays by name, read-only, backed by the frame's own bytes unless they came compressed.
    """

    kind: str
    fields: Fields
    payloads: Mapping[str, NDArray[Any]]

    def expect(self, kind: str) -> Frame:
        """This frame, if it is of `kind`; else MalformedAnswerError."""
        if self.kind != kind:
            raise MalformedAnswerError(f"expected a frame of kind {kind!r}, got {self.kind!r}")
        return self

    def array(self, name: str, dtype: str, columns: int | None = None) -> NDArray[Any]:
        """The payload `name` as (n,) or (n, columns) of exactly `dtype`; else MalformedAnswerError."""
        value = self.payloads.get(name)
        if value is None:
            raise MalformedAnswerError(f"{self.kind} frame: payload {name!r} is missing")
        shaped = value.ndim == 1 if columns is None else value.ndim == 2 and value.shape[1] == columns
        if value.dtype.str != dtype or not shaped:
            wanted = f"{dtype} (n,{columns if columns else ''})"
            raise MalformedAnswerError(f"{self.kind} frame: {name} is {value.dtype.str} {value.shape}, not {wanted}")
        return value


@dataclass(frozen=True, eq=False)
class OutgoingFrame:
    """A frame laid out to be sent. Its arrays are the caller's own, not copied; they are summed when `parts` is called.

    Attributes:
        header_bytes: length of the header without its padding.
        content: everything behind the frame's prefix, in order.
    """

    header_bytes: int
    content: Sequence[bytes | NDArray[np.uint8]] = field(repr=False)

    def __len__(self) -> int:
        return _PREFIX.size + sum(map(len, self.content))

    def parts(self) -> list[bytes | memoryview]:
        """The frame as buffers to be sent one after the other."""
        crc = 0
        for part in self.content:
            crc = google_crc32c.extend(crc, part)
        prefix = _PREFIX.pack(_MAGIC, self.header_bytes, len(self), crc, 0)
        return [prefix, *(part if isinstance(part, bytes) else part.data for part in self.content)]

    def to_bytes(self) -> bytes:
        """The frame as one copy."""
        return b"".join(self.parts())


def encode_frame(
    kind: str, fields: Mapping[str, object], payloads: Mapping[str, NDArray[Any]], compression: Compression = None
) -> bytes:
    """Build a frame; otherwise as `lay_out_frame`."""
    return lay_out_frame(kind, fields, payloads, compression).to_bytes()


def lay_out_frame(
    kind: str, fields: Mapping[str, object], payloads: Mapping[str, NDArray[Any]], compression: Compression = None
) -> OutgoingFrame:
    """A frame that is complete but for its checksum.

    Raises:
        InvalidInputError: a dtype that the frame cannot carry, or a header value that is not JSON.
    """
    bodies: list[NDArray[np.uint8]] = []
    entries: list[dict[str, object]] = []
    for name, array in payloads.items():
        stored = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        if stored.dtype.str not in _DTYPES:
            raise InvalidInputError(f"{name}: dtype {array.dtype} cannot be sent; use one of {sorted(_DTYPES)}")
        body = stored.reshape(-1).view(np.uint8)
        body.flags.writeable = False  # google_crc32c takes only buffers that promise not to change
        if compression == "zstd":
            body = _compress(body)
        entries.append({"name": name, "dtype": stored.dtype.str, "shape": list(array.shape), "offset": 0})
        entries[-1] |= {"nbytes": body.nbytes, "encoding": compression or "raw"}
        bodies.append(body)
    header, data_start = _header(kind, fields, entries)
    content: list[bytes | NDArray[np.uint8]] = [header.ljust(data_start - _PREFIX.size, b"\0")]
    position = data_start
    for body in bodies:
        if gap := -position % _ALIGNMENT:
            content.append(bytes(gap))
        content.append(body)
        position += gap + body.nbytes
    return OutgoingFrame(len(header), content)


def _header(kind: str, fields: Mapping[str, object], entries: list[dict[str, object]]) -> tuple[bytes, int]:
    # The offsets stand in the header whose length decides them; a later start never shortens the text, so this ends.
    data_start = _ALIGNMENT
    while True:
        position = data_start
        for entry in entries:
            position += -position % _ALIGNMENT
            entry["offset"] = position
            position += int(str(entry["nbytes"]))
        try:
            text = _ENCODER.encode({"kind": kind, **fields, "payloads": entries})
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"a {kind} frame cannot carry its header: {error}") from error
        header = text.encode()
        needed = _PREFIX.size + len(header)
        needed += -needed % _ALIGNMENT
        if needed == data_start:
            return header, data_start
        data_start = needed


def decode_frame(data: bytes, max_expanded_bytes: int = MAX_EXPANDED_BYTES) -> Frame:
    """Read a frame and check everything before anything is allocated from it.

    Raises:
        MalformedAnswerError: wrong magic, length, checksum or header, payloads that overlap, leave the frame or lie
            about their size, or expand to more than `max_expanded_bytes` in all.
    """
    if len(data) < _PREFIX.size:
        raise MalformedAnswerError(f"a frame of {len(data)} bytes is shorter than its own prefix")
    magic, header_bytes, frame_bytes, crc, reserved = _PREFIX.unpack_from(data)
    if magic != _MAGIC or reserved != 0:
        raise MalformedAnswerError(f"not a rayvox frame: it starts with {magic!r}, reserved word {reserved}")
    if frame_bytes != len(data):
        raise MalformedAnswerError(f"the frame claims {frame_bytes} bytes and has {len(data)}")
    header_end = _PREFIX.size + header_bytes
    data_start = header_end + -header_end % _ALIGNMENT
    if data_start > len(data):
        raise MalformedAnswerError(f"the frame claims a header of {header_bytes} bytes and has {len(data)} in all")
    actual_crc = google_crc32c.value(np.frombuffer(data, np.uint8, offset=_PREFIX.size))
    if actual_crc != crc:
        raise MalformedAnswerError(f"the frame's checksum is {actual_crc:#010x}, it claims {crc:#010x}")
    fields = Fields.parse(data[_PREFIX.size : header_end], "frame header")
    return Frame(fields.text("kind"), fields, _payloads(data, data_start, fields, max_expanded_bytes))


def _payloads(data: bytes, data_start: int, fields: Fields, budget: int) -> dict[str, NDArray[Any]]:
    payloads: dict[str, NDArray[Any]] = {}
    end = data_start
    for entry in fields.list_of("payloads"):
        name, offset, nbytes = entry.text("name"), entry.integer("offset"), entry.integer("nbytes")
        if name in payloads:
            raise MalformedAnswerError(f"{entry.where}: a second payload named {name!r}")
        if offset % _ALIGNMENT or offset < end or nbytes < 0 or offset + nbytes > len(data):
            raise MalformedAnswerError(f"{entry.where}: bytes {offset} to {offset + nbytes} overlap or leave the frame")
        dtype, shape = _dtype_and_shape(entry)
        expanded = prod(shape) * dtype.itemsize
        if expanded > budget:
            raise MalformedAnswerError(f"{entry.where}: expands to {expanded} bytes, {budget} are allowed")
        budget -= expanded
        encoding = entry.text("encoding")
        if encoding == "raw" and nbytes == expanded:
            flat = np.frombuffer(data, dtype, count=prod(shape), offset=offset)
        elif encoding == "zstd":
            flat = _expand(data[offset : offset + nbytes], expanded, entry.where).view(dtype)
        else:
            raise MalformedAnswerError(f"{entry.where}: {nbytes} bytes as {encoding!r} are not {expanded} bytes")
        payloads[name] = flat.reshape(shape)
        end = offset + nbytes
    if end != len(data):
        raise MalformedAnswerError(f"{len(data) - end} bytes follow the frame's last payload")
    return payloads


def _dtype_and_shape(entry: Fields) -> tuple[np.dtype[Any], tuple[int, ...]]:
    text, shape = entry.text("dtype"), entry.values.get("shape")
    if text not in _DTYPES:
        raise MalformedAnswerError(f"{entry.where}: unknown dtype {text!r}")
    if not isinstance(shape, list) or not 1 <= len(shape) <= 4:
        raise MalformedAnswerError(f"{entry.where}: shape = {shape!r:.100} is not a list of one to four sizes")
    if not all(isinstance(n, int) and not isinstance(n, bool) and 0 <= n < 1 << 48 for n in shape):
        raise MalformedAnswerError(f"{entry.where}: shape = {shape!r:.100} holds something that is no size")
    return np.dtype(text), tuple(shape)


def _compress(body: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import zstandard

    return np.frombuffer(zstandard.ZstdCompressor(level=1).compress(body.data), np.uint8)


def _expand(stored: bytes, expanded: int, where: str) -> NDArray[np.uint8]:
    import zstandard

    # Read into a buffer of the checked size: decompress() would allocate what the stored bytes claim.
    out = np.empty(expanded + 1, np.uint8)
    filled = 0
    try:
        with zstandard.ZstdDecompressor().stream_reader(stored, read_across_frames=False) as reader:
            while filled < out.size and (count := reader.readinto(out.data[filled:])):
                filled += count
    except zstandard.ZstdError as error:
        raise MalformedAnswerError(f"{where}: not zstd: {error}") from error
    if filled != expanded:
        raise MalformedAnswerError(f"{where}: expands to other than the claimed {expanded} bytes")
    out = out[:expanded]
    out.flags.writeable = False
    return out
