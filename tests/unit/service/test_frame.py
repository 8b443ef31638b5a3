from __future__ import annotations

import json
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rayvox_service.frame import (
    DTYPES,
    UNLIMITED,
    FrameError,
    FrameLimits,
    FrameTooLargeError,
    decode_frame,
    encode_frame,
    encode_frame_parts,
)

from tests.golden.golden_frames import FOLDER, FRAMES, slow_crc32c

LIMITS = FrameLimits(1 << 20, 1 << 20)


def seal(body: bytes, header_bytes: int) -> bytes:
    prefix = struct.pack("<4sIQ", b"RVX1", header_bytes, 24 + len(body))
    return prefix + struct.pack("<II", google_crc32c.value(body), 0) + body


def forge(document: object, payload: bytes = b"", text: bytes | None = None) -> bytes:
    """A frame whose CRC is right, whatever its header says."""
    header = json.dumps(document).encode() if text is None else text
    return seal(header + bytes(-(24 + len(header)) % 64) + payload, len(header))


def entry(**changes: Any) -> dict[str, Any]:
    fields = {"name": "a", "dtype": "<f4", "shape": [4], "offset": 192, "nbytes": 16, "encoding": "raw"}
    return {**fields, **changes}


def one_payload(payload: bytes = bytes(16), **changes: Any) -> bytes:
    document = {"kind": "x", "payloads": [entry(**changes)], "pad": ""}
    document["pad"] = " " * (192 - 24 - len(json.dumps(document)))
    return forge(document, payload)


@pytest.mark.parametrize("name", FRAMES)
def test_the_committed_golden_files_are_the_bytes_written_by_hand(name: str) -> None:
    assert (FOLDER / f"{name}.bin").read_bytes() == FRAMES[name].to_bytes()


@pytest.mark.parametrize("name", FRAMES)
def test_every_golden_frame_decodes_to_what_was_written_by_hand(name: str) -> None:
    golden = FRAMES[name]
    frame = decode_frame((FOLDER / f"{name}.bin").read_bytes(), LIMITS)
    header = json.loads(golden.header)
    listed = header.pop("payloads")
    assert frame.kind == header.pop("kind")
    assert frame.fields == header
    assert list(frame.payloads) == [item["name"] for item in listed]
    for item, (_, content) in zip(listed, golden.payloads, strict=True):
        array = frame.array(item["name"])
        assert (array.dtype.str, list(array.shape)) == (item["dtype"], item["shape"])
        assert array.tobytes() == content


@pytest.mark.parametrize("name", FRAMES)
def test_encoding_a_golden_frames_content_gives_its_bytes(name: str) -> None:
    golden = FRAMES[name]
    fields = json.loads(golden.header)
    kind, listed = fields.pop("kind"), fields.pop("payloads")
    arrays = {
        item["name"]: np.frombuffer(content, item["dtype"]).reshape(item["shape"])
        for item, (_, content) in zip(listed, golden.payloads, strict=True)
    }
    assert encode_frame(kind, fields, arrays) == (FOLDER / f"{name}.bin").read_bytes()


def test_the_hand_written_checksum_is_castagnolis() -> None:
    # The check value that RFC 3720's tables give for these nine digits.
    assert slow_crc32c(b"123456789") == 0xE3069283


@given(
    arrays=st.dictionaries(
        st.text(max_size=5),
        st.sampled_from(DTYPES).flatmap(lambda dtype: hnp.arrays(np.dtype(dtype), hnp.array_shapes(min_side=0))),
        max_size=4,
    ),
    zstd=st.booleans(),
    note=st.text(max_size=200),
)
def test_any_arrays_come_back_bit_for_bit(arrays: dict[str, Any], zstd: bool, note: str) -> None:
    data = encode_frame("x", {"note": note}, arrays, zstd=zstd)
    frame = decode_frame(data, UNLIMITED)
    assert frame.fields == {"note": note}
    assert list(frame.payloads) == list(arrays)
    for name, array in arrays.items():
        assert frame.array(name).dtype == array.dtype
        assert frame.array(name).shape == array.shape
        assert frame.array(name).tobytes() == array.tobytes()
    assert all(payload.offset % 64 == 0 for payload in frame.payloads.values())
    assert b"".join(encode_frame_parts("x", {"note": note}, arrays, zstd=zstd)) == data


def test_a_raw_payload_is_a_view_of_the_frame_and_cannot_be_written() -> None:
    data = bytearray(encode_frame("x", {}, {"a": np.arange(6, dtype="<f4")}))
    array = decode_frame(data, LIMITS).array("a")
    data[-4:] = struct.pack("<f", 99.0)
    assert array[-1] == 99.0


@given(position=st.integers(0, 10_000), flip=st.integers(1, 255))
def test_a_flip_of_any_byte_is_noticed(position: int, flip: int) -> None:
    data = bytearray(FRAMES["scan"].to_bytes())
    data[position % len(data)] ^= flip
    with pytest.raises(FrameError):
        decode_frame(data, LIMITS)


@given(cut=st.integers(0, 10_000), more=st.binary(max_size=70))
def test_a_frame_that_is_cut_or_continued_is_refused(cut: int, more: bytes) -> None:
    data = FRAMES["scan"].to_bytes()
    changed = data[: cut % (len(data) + 1)] + more
    if changed != data:
        with pytest.raises(FrameError):
            decode_frame(changed, LIMITS)


@given(st.binary(max_size=300), st.integers(0, 300))
def test_any_body_under_a_right_checksum_is_decoded_or_refused_with_a_frame_error(body: bytes, header: int) -> None:
    with suppress(FrameError):
        decode_frame(seal(body, header), LIMITS)


LIES: dict[str, Callable[[], bytes]] = {
    "a header that is no object": lambda: forge([]),
    "a header that is no JSON": lambda: forge(None, text=b"{kind"),
    "a header that is not UTF-8": lambda: forge(None, text=b'{"kind":"\xff","payloads":[]}'),
    "NaN in the header": lambda: forge(None, text=b'{"kind":"x","payloads":[],"a":NaN}'),
    "a header nested too deeply": lambda: forge(None, text=b"[" * 100_000),
    "a number with too many digits": lambda: forge(None, text=b'{"kind":"x","payloads":[],"a":' + b"1" * 5000 + b"}"),
    "no kind": lambda: forge({"payloads": []}),
    "payloads that are no list": lambda: forge({"kind": "x", "payloads": {}}),
    "more payloads than allowed": lambda: forge({"kind": "x", "payloads": [entry()] * 33}),
    "a payload that is no object": lambda: forge({"kind": "x", "payloads": [7]}),
    "a payload without a shape": lambda: forge({"kind": "x", "payloads": [{"name": "a"}]}),
    "an unknown dtype": lambda: one_payload(dtype="|O8"),
    "a dtype that is a list": lambda: one_payload(dtype=["<f4"]),
    "an unknown encoding": lambda: one_payload(encoding="gzip"),
    "a negative count": lambda: one_payload(shape=[-4]),
    "a count that is true": lambda: one_payload(shape=[True]),
    "a count that is a fraction": lambda: one_payload(shape=[4.0]),
    "a count beyond 64 bits": lambda: one_payload(shape=[1 << 64]),
    "no dimension": lambda: one_payload(shape=[]),
    "too many dimensions": lambda: one_payload(shape=[1, 1, 1, 1, 4]),
    "a shape that needs more bytes than are there": lambda: one_payload(shape=[5]),
    "a shape that needs fewer bytes than are there": lambda: one_payload(shape=[3]),
    "an offset that is not the next multiple of 64": lambda: one_payload(offset=200),
    "an offset behind the end": lambda: one_payload(offset=256),
    "an offset within the header": lambda: one_payload(offset=64),
    "more stored bytes than the frame has": lambda: one_payload(nbytes=32, shape=[8]),
    "bytes behind the last payload": lambda: one_payload(payload=bytes(20)),
    "two payloads of one name": lambda: forge(
        {"kind": "x", "payloads": [entry(nbytes=0, shape=[0], offset=256), entry(nbytes=0, shape=[0], offset=256)]}
    ),
    "a gap that is not zero": lambda: seal(b'{"kind":"x","payloads":[]}' + b"\1" * 14, 26),
    "zstd that is none": lambda: one_payload(encoding="zstd"),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_frame_that_lies_is_refused(lie: str) -> None:
    with pytest.raises(FrameError):
        decode_frame(LIES[lie](), LIMITS).array("a")


@pytest.mark.parametrize(
    ("field", "value"), [("magic", b"RVX2"), ("header_bytes", 1 << 31), ("frame_bytes", 1), ("reserved", 1)]
)
def test_a_wrong_prefix_is_refused(field: str, value: Any) -> None:
    data = FRAMES["scan"].to_bytes()
    names = ["magic", "header_bytes", "frame_bytes", "crc", "reserved"]
    prefix = dict(zip(names, struct.unpack("<4sIQII", data[:24]), strict=True))
    prefix[field] = value
    with pytest.raises(FrameError):
        decode_frame(struct.pack("<4sIQII", *prefix.values()) + data[24:], LIMITS)


def test_a_billion_claimed_points_are_refused_by_their_size() -> None:
    with pytest.raises(FrameTooLargeError, match="12000000000"):
        decode_frame(one_payload(shape=[1_000_000_000, 3], nbytes=16), LIMITS)


def test_a_frame_over_the_byte_limit_is_refused_before_it_is_read() -> None:
    with pytest.raises(FrameTooLargeError):
        decode_frame(bytes(2000), FrameLimits(1999, 1 << 20))


def compressed(octets: bytes, *, claim: bool = True) -> bytes:
    if claim:
        return zstandard.ZstdCompressor().compress(octets)
    stream = zstandard.ZstdCompressor().compressobj()
    return stream.compress(octets) + stream.flush()


@pytest.mark.parametrize("claim", [True, False])
@pytest.mark.parametrize("true_size", [0, 3996, 4004, 1 << 22])
def test_zstd_that_expands_to_another_size_than_its_shape_is_refused(true_size: int, claim: bool) -> None:
    stored = compressed(bytes(true_size), claim=claim)
    data = one_payload(payload=stored, encoding="zstd", nbytes=len(stored), shape=[1000])
    with pytest.raises(FrameError):
        decode_frame(data, LIMITS).array("a")


@pytest.mark.parametrize("claim", [True, False])
def test_zstd_with_and_without_a_claimed_size_expands_to_its_shape(claim: bool) -> None:
    octets = np.arange(1000, dtype="<f4").tobytes()
    stored = compressed(octets, claim=claim)
    data = one_payload(payload=stored, encoding="zstd", nbytes=len(stored), shape=[1000])
    assert decode_frame(data, LIMITS).array("a").tobytes() == octets


def test_zstd_with_bytes_behind_it_is_refused() -> None:
    stored = compressed(bytes(4000)) + b"more"
    data = one_payload(payload=stored, encoding="zstd", nbytes=len(stored), shape=[1000])
    with pytest.raises(FrameError):
        decode_frame(data, LIMITS).array("a")


def test_zstd_that_would_expand_past_the_limit_is_refused_before_anything_is_expanded() -> None:
    stored = compressed(bytes(1 << 24))
    data = one_payload(payload=stored, encoding="zstd", nbytes=len(stored), shape=[1 << 22])
    with pytest.raises(FrameTooLargeError):
        decode_frame(data, LIMITS)


def test_a_missing_payload_is_named() -> None:
    with pytest.raises(FrameError, match="points"):
        decode_frame(encode_frame("scan", {}, {}), LIMITS).array("points")


def test_golden_files_and_their_source_are_the_same_set() -> None:
    assert {path.stem for path in Path(FOLDER).glob("*.bin")} == set(FRAMES)
