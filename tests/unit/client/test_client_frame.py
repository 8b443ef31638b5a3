"""The client's frame codec, against frames written by hand and against hostile ones."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from rayvox_client import InvalidInputError, MalformedAnswerError, Scan
from rayvox_client.attached_object import AttachedObject
from rayvox_client.clearance import Clearance
from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.endpoint import Endpoint
from rayvox_client.frame import Compression, decode_frame, encode_frame
from rayvox_client.map_changes import MapChanges
from rayvox_client.occupancy import Occupancy, RayHits
from rayvox_client.requests import Requests
from rayvox_client.robot_question import check_question, motion_question
from rayvox_client.self_filter import SelfFilter

from tests.golden.golden_frames import FOLDER, FRAMES, SCAN_ID, slow_crc32c

REQUESTS = Requests(Endpoint.parse("http://robot:8080", None))
DTYPES = st.sampled_from(["<f4", "<f8", "<i2", "<i4", "<i8", "<u2", "<u4", "|u1"])
ARRAYS = DTYPES.flatmap(lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=1, max_dims=3, min_side=0)))
POSE = [[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, -1.25], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]]


def golden(name: str) -> bytes:
    return (FOLDER / f"{name}.bin").read_bytes()


def seal(header: object, payload: bytes = b"") -> bytes:
    """A frame whose length and checksum are right, whatever its header says."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    body = text + bytes(-(24 + len(text)) % 64) + payload
    prefix = b"RVX1" + struct.pack("<IQ", len(text), 24 + len(body))
    return prefix + struct.pack("<II", slow_crc32c(body), 0) + body


def entry(**changed: object) -> dict[str, object]:
    """A header whose one payload is as it should be, but for what is changed: four u2 in the second 256 bytes."""
    payload = {"name": "a", "dtype": "<u2", "shape": [4], "offset": 192, "nbytes": 8, "encoding": "raw"}
    return {"kind": "k", "payloads": [payload | changed]}


def test_a_scan_is_encoded_to_the_golden_bytes() -> None:
    points = np.array([[1.0, 2.0, 3.0], [-1.5, 0.25, 4.0], [7.0, -8.0, 0.125]], np.float32)
    scan = Scan(
        points,
        POSE,
        origin=(0, 0, 0.25),
        max_range_m=30,
        no_return=[[0.0, 20.0, 0.0]],
        scan_id=SCAN_ID.upper(),
        stamp_s=12.5,
    )
    assert scan.to_frame() == golden("scan")


def test_queries_are_encoded_to_the_golden_bytes() -> None:
    points, _ = REQUESTS.points("m", [[1.0, 2.0, 3.0], [1e6, -1e6, 0.5]], 14, None)
    boxes, _ = REQUESTS.boxes("m", [[-1, -1, 0]], [[1, 1, 2]], None)
    origin, direction = np.array([[0, 0, 1]], np.float32), np.array([[1, 0, 0]], np.float32)
    rays, _ = REQUESTS.rays("m", origin, direction, 12.5, "occupied", None)
    assert points.body.to_bytes() == golden("points")
    assert boxes.body.to_bytes() == golden("boxes")
    assert rays.body.to_bytes() == golden("rays")


def test_a_collision_query_is_encoded_to_the_golden_bytes() -> None:
    question = check_question(
        "arm",
        [0.5, -1.25],
        POSE,
        {
            "unknown": "occupied",
            "padding_m": 0.25,
            "occupancy_threshold": 0.75,
            "self_collision": True,
            "contacts": "first",
            "min_revision": None,
        },
    )
    assert REQUESTS.question("m", question).body.to_bytes() == golden("collisions")
    assert question.to_message() == golden("collisions")


def test_a_motion_query_with_a_held_object_is_encoded_to_the_golden_bytes() -> None:
    held = AttachedObject("hand", POSE, box=(0.5, 0.25, 1.0), name="load", touch_links=["left"])
    ends = [1.0, 2.0], [-3.0, 0.25]
    question = motion_question(
        "arm", [0.5, -1.25], ends, POSE, {"tolerance_m": 0.125, "unknown": "free", "attached": [held]}
    )
    assert question.to_message() == golden("motions")
    with pytest.raises(MalformedAnswerError):
        question.read(decode_frame(golden("verdicts")))


def test_a_scan_with_its_robot_is_encoded_to_the_golden_bytes() -> None:
    own = SelfFilter("arm", [0.5, -1.25], sensor_link="hand", T_link_sensor=POSE, padding_m=0.25)
    scan = Scan(np.array([[1, 2, 3]], np.float32), POSE, scan_id=SCAN_ID, self_filter=own)
    assert scan.to_frame() == golden("scan_self_filter")


def test_golden_motion_verdicts_are_read() -> None:
    check = MotionCheck.from_frame(decode_frame(golden("motion_verdicts")), 2)
    assert (check.revision, check.tolerance_m, check.verdicts.tolist()) == (12, 0.125, [0, 1])
    assert (check.free_until.tolist(), check.free.tolist()) == ([1.0, 0.375], [True, False])
    with pytest.raises(MalformedAnswerError):
        MotionCheck.from_frame(decode_frame(golden("motion_verdicts")), 1)


def test_golden_verdicts_are_read() -> None:
    check = CollisionCheck.from_frame(decode_frame(golden("verdicts")), 3)
    assert (check.revision, check.verdicts.tolist(), check.free.tolist()) == (11, [0, 1, 2], [True, False, False])
    assert check.self_colliding is not None
    assert check.self_colliding.tolist() == [False, False, True]
    assert check.contacts is not None
    assert (check.contacts.pose.tolist(), check.contacts.link.tolist()) == ([1, 2], [3, 0])
    assert check.contacts.centre_m.tolist() == [[0.05, 0.15, -0.25], [1.0, 2.0, 3.0]]
    assert check.contacts.size_m.tolist() == [0.1, 0.4]
    np.testing.assert_array_equal(check.contacts.log_odds, np.array([0.84375, np.nan], np.float32))
    with pytest.raises(MalformedAnswerError):
        CollisionCheck.from_frame(decode_frame(golden("verdicts")), 2)


def test_golden_clearances_are_read() -> None:
    clearance = Clearance.from_frame(decode_frame(golden("clearances")), 2)
    assert (clearance.revision, clearance.verdicts.tolist()) == (12, [0, 0])
    assert clearance.clearance_m.tolist() == [0.25, 0.5]
    assert clearance.is_lower_bound.tolist() == [False, True]
    assert (clearance.direction[0].tolist(), clearance.link.tolist()) == ([0.0, 0.6, -0.8], [3, -1])
    assert (clearance.point_m[0].tolist(), clearance.voxel_centre_m[0].tolist()) == ([1, 2, 3], [1.05, 2.15, 2.75])
    assert clearance.voxel_size_m[0] == 0.1
    for column in (clearance.direction, clearance.point_m, clearance.voxel_centre_m, clearance.voxel_size_m):
        assert np.isnan(column[1]).all()
    with pytest.raises(MalformedAnswerError):
        Clearance.from_frame(decode_frame(golden("clearances")), 3)
    with pytest.raises(MalformedAnswerError):
        Clearance.from_frame(decode_frame(golden("verdicts")), 3)


def test_golden_answers_are_read() -> None:
    occupancy = Occupancy.from_frame(decode_frame(golden("occupancy")), 3)
    assert occupancy.revision == 7
    assert occupancy.states.tolist() == [0, 1, 2]
    np.testing.assert_array_equal(occupancy.log_odds, np.array([np.nan, -0.40625, 3.5], np.float32))
    hits = RayHits.from_frame(decode_frame(golden("hits")), 2)
    assert (hits.hit.tolist(), hits.voxel.tolist(), hits.t_m[0]) == ([1, 0], [[10, -20, 30], [0, 0, 0]], 4.25)
    changes = MapChanges.from_frame(decode_frame(golden("changes")))
    assert (changes.since, changes.revision, changes.full, changes.resolution_m) == (3, 5, False, 0.05)
    assert changes.region_keys.tolist() == [[8, -16, 0]]
    assert changes.keys.tolist() == [[8, -16, 0], [9, -16, 0]]
    assert changes.leaf_depth.tolist() == [16, 15]
    assert changes.log_odds.tolist() == [0.84375, -0.40625]


@pytest.mark.parametrize("name", FRAMES)
def test_any_changed_byte_of_a_golden_frame_is_noticed(name: str) -> None:
    good = golden(name)
    decode_frame(good)
    for position in range(len(good)):
        bad = bytearray(good)
        bad[position] ^= 0x10
        with pytest.raises(MalformedAnswerError):
            decode_frame(bytes(bad))


@given(st.dictionaries(st.text(max_size=8), ARRAYS, max_size=4), st.sampled_from([None, "zstd"]), st.data())
def test_what_is_encoded_is_decoded(
    arrays: dict[str, NDArray[Any]], compression: Compression, data: st.DataObject
) -> None:
    fields = data.draw(st.dictionaries(st.text(max_size=8), st.none() | st.integers() | st.text()))
    fields = {k: v for k, v in fields.items() if k not in ("kind", "payloads")}
    frame = decode_frame(encode_frame("probe", fields, arrays, compression))
    assert frame.kind == "probe"
    assert {k: frame.fields.values[k] for k in fields} == fields
    assert list(frame.payloads) == list(arrays)
    for name, array in arrays.items():
        assert frame.payloads[name].dtype == array.dtype
        np.testing.assert_array_equal(frame.payloads[name], array)


@given(st.integers(0, 400))
def test_payloads_start_at_multiples_of_64_whatever_the_headers_length(filler: int) -> None:
    data = encode_frame("k", {"filler": "x" * filler}, {"a": np.zeros(5, np.uint8), "b": np.ones(3, "<f8")})
    header = json.loads(data[24 : 24 + struct.unpack_from("<I", data, 4)[0]])
    assert all(payload["offset"] % 64 == 0 for payload in header["payloads"])
    assert struct.unpack_from("<f8".replace("f8", "d"), data, header["payloads"][1]["offset"]) == (1.0,)
    assert slow_crc32c(data[24:]) == struct.unpack_from("<I", data, 16)[0]


def test_big_endian_and_strided_arrays_arrive_as_their_values() -> None:
    array = np.arange(24, dtype=">f8").reshape(4, 6)[::2, ::3]
    np.testing.assert_array_equal(decode_frame(encode_frame("k", {}, {"a": array})).payloads["a"], array)


def test_a_dtype_that_the_frame_does_not_know_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="complex128"):
        encode_frame("k", {}, {"a": np.zeros(2, complex)})
    with pytest.raises(InvalidInputError, match="header"):
        encode_frame("k", {"x": float("nan")}, {})


@given(st.binary(max_size=200))
def test_noise_is_refused(data: bytes) -> None:
    with pytest.raises(MalformedAnswerError):
        decode_frame(data)


@pytest.mark.parametrize("cut", [0, 1, 23, 24, 100, 255])
def test_a_cut_frame_is_refused(cut: int) -> None:
    with pytest.raises(MalformedAnswerError):
        decode_frame(golden("occupancy")[:cut])


def test_the_forged_frame_of_these_tests_is_good_when_nothing_is_changed() -> None:
    frame = decode_frame(seal(entry(), struct.pack("<4H", 1, 2, 3, 4)))
    assert frame.payloads["a"].tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize(
    "header",
    [
        entry(nbytes=7),
        entry(nbytes=-8),
        entry(offset=128),
        entry(offset=128, shape=[36], nbytes=72),
        entry(offset=196, shape=[2], nbytes=4),
        entry(offset=200),
        entry(offset=256),
        entry(offset=1 << 70),
        entry(shape=[5]),
        entry(shape=[-4]),
        entry(shape=[1 << 40, 1 << 40]),
        entry(shape=[10**9]),
        entry(shape=[True, 4]),
        entry(shape=[]),
        entry(shape="4"),
        entry(dtype="|O8"),
        entry(dtype=">u2"),
        entry(dtype=3),
        entry(encoding="gzip"),
        entry(name=None),
        {"kind": "k", "payloads": []},
        {"kind": "k", "payloads": [None]},
        {"kind": "k"},
        {"payloads": []},
        {"kind": 3, "payloads": []},
        [],
        b'{"kind": NaN, "payloads": []}',
        b"[" * 10_000,
        b"\xff\xfe",
    ],
    ids=str,
)
def test_a_frame_that_lies_is_refused(header: object) -> None:
    with pytest.raises(MalformedAnswerError):
        decode_frame(seal(header, struct.pack("<4H", 1, 2, 3, 4)))


@pytest.mark.parametrize(
    "stored",
    [
        zstandard.compress(bytes(9)),
        zstandard.compress(bytes(7)),
        zstandard.compress(bytes(1 << 30)),
        zstandard.compress(bytes(8))[:-1],
        b"not zstd at all.",
        b"",
    ],
    ids=["too long", "too short", "bomb", "cut", "noise", "empty"],
)
def test_a_compressed_payload_must_expand_to_exactly_its_size(stored: bytes) -> None:
    with pytest.raises(MalformedAnswerError):
        decode_frame(seal(entry(encoding="zstd", nbytes=len(stored)), stored))


def test_more_than_the_limit_is_refused_before_it_is_expanded() -> None:
    data = encode_frame("k", {}, {"a": np.zeros(1 << 20, np.uint8)}, "zstd")
    assert len(data) < 1000
    decode_frame(data, max_expanded_bytes=1 << 20)
    with pytest.raises(MalformedAnswerError, match="are allowed"):
        decode_frame(data, max_expanded_bytes=(1 << 20) - 1)


@pytest.mark.parametrize(
    "answer",
    [
        lambda: encode_frame("hits", {"revision": 1}, {"states": np.zeros(3, np.uint8)}),
        lambda: encode_frame("occupancy", {"revision": 1}, {}),
        lambda: encode_frame("occupancy", {}, {"states": np.zeros(3, np.uint8)}),
        lambda: encode_frame("occupancy", {"revision": "1"}, {"states": np.zeros(3, np.uint8)}),
        lambda: encode_frame("occupancy", {"revision": 1}, {"states": np.zeros(2, np.uint8)}),
        lambda: encode_frame("occupancy", {"revision": 1}, {"states": np.zeros(3, np.uint16)}),
        lambda: encode_frame("occupancy", {"revision": 1}, {"states": np.zeros((3, 1), np.uint8)}),
    ],
    ids=["kind", "no states", "no revision", "revision", "count", "dtype", "shape"],
)
def test_an_answer_that_does_not_fit_the_question_is_refused(answer: Callable[[], bytes]) -> None:
    with pytest.raises(MalformedAnswerError):
        Occupancy.from_frame(decode_frame(answer()), 3)
