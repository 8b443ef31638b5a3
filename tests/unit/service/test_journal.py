from __future__ import annotations

import errno
import os
import uuid
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rayvox_service.frame import encode_frame
from rayvox_service.journal import SEGMENT_HEADER, Journal, list_segments
from rayvox_service.journal_recovery import JournalCut, JournalGapError, JournalRecovery

LARGE = 1 << 30


def frame(number: int) -> bytes:
    return encode_frame("clear_box", {"lo": [number, 0, 0], "hi": [number, 1, 1], "pad": "x" * (number % 7)}, {})


def recover(directory: Path, after: int = 0) -> tuple[list[int], JournalRecovery, JournalCut | None]:
    """The numbers of the frames that are read back, in order."""
    recovery = JournalRecovery(directory, after)
    numbers = [int(read.fields["lo"][0]) for _, read in recovery]
    return numbers, recovery, recovery.cut()


def open_journal(directory: Path, next_sequence: int = 1, segment_bytes: int = LARGE) -> Journal:
    return Journal(directory, next_sequence, segment_bytes=segment_bytes, fsync=False)


def write(directory: Path, groups: Sequence[Sequence[int]], segment_bytes: int = LARGE) -> None:
    journal = open_journal(directory, 1, segment_bytes)
    for group in groups:
        journal.write([frame(number) for number in group])
        journal.sync()
    journal.close()


@pytest.fixture
def fresh(tmp_path: Path) -> Path:
    """A new directory for every example of a property."""
    directory = tmp_path / uuid.uuid4().hex
    directory.mkdir()
    return directory


def a_directory(parent: Path) -> Path:
    directory = parent / uuid.uuid4().hex
    directory.mkdir()
    return directory


def test_what_was_written_is_read_back_in_order(fresh: Path) -> None:
    write(fresh, [[1], [2, 3], [4]])
    numbers, recovery, cut = recover(fresh)
    assert (numbers, recovery.last_sequence, cut) == ([1, 2, 3, 4], 4, None)


def test_an_empty_journal_reads_as_nothing(fresh: Path) -> None:
    assert recover(fresh)[0] == []
    write(fresh, [])
    assert recover(fresh)[0] == []


def test_records_through_the_snapshot_are_stepped_over(fresh: Path) -> None:
    write(fresh, [[1, 2, 3, 4]])
    numbers, recovery, _ = recover(fresh, after=2)
    assert (numbers, recovery.last_sequence) == ([3, 4], 4)


def test_damage_in_records_that_the_snapshot_holds_cuts_nothing(fresh: Path) -> None:
    write(fresh, [[1, 2, 3]])
    path = list_segments(fresh)[0].path
    data = bytearray(path.read_bytes())
    data[SEGMENT_HEADER.size + 24 + 30] ^= 1
    path.write_bytes(data)
    assert recover(fresh, after=1)[0] == [2, 3]


def test_segments_follow_each_other_and_are_dropped_once_a_snapshot_holds_them(fresh: Path) -> None:
    write(fresh, [[n] for n in range(1, 9)], segment_bytes=300)
    first = [segment.first_sequence for segment in list_segments(fresh)]
    assert len(first) > 3
    journal = open_journal(fresh, 9, segment_bytes=300)
    journal.drop_through(first[2])
    journal.close()
    assert [segment.first_sequence for segment in list_segments(fresh)] == first[2:]
    assert recover(fresh, after=first[2])[0] == list(range(first[2] + 1, 9))


def test_the_open_segment_is_never_dropped(fresh: Path) -> None:
    write(fresh, [[1, 2]])
    journal = open_journal(fresh, 3)
    journal.drop_through(2)
    journal.write([frame(3)])
    journal.sync()
    journal.close()
    assert recover(fresh, after=2)[0] == [3]


def test_a_journal_that_starts_behind_the_snapshot_is_refused(fresh: Path) -> None:
    write(fresh, [[n] for n in range(1, 9)], segment_bytes=300)
    list_segments(fresh)[0].path.unlink()
    with pytest.raises(JournalGapError):
        recover(fresh)


def record_ends(directory: Path) -> list[int]:
    """Byte offsets behind each record of the only segment."""
    ends = [SEGMENT_HEADER.size]
    size = list_segments(directory)[0].path.stat().st_size
    number = 1
    while ends[-1] < size:
        ends.append(ends[-1] + 24 + len(frame(number)))
        number += 1
    return ends


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_torn_tail_is_cut_at_the_last_good_record(tmp_path: Path, data: st.DataObject) -> None:
    directory = a_directory(tmp_path)
    write(directory, [[1, 2, 3, 4]])
    path = list_segments(directory)[0].path
    ends = record_ends(directory)
    size = data.draw(st.integers(0, ends[-1]))
    os.truncate(path, size)
    whole = max(sum(end <= size for end in ends) - 1, 0)
    numbers, recovery, cut = recover(directory)
    assert numbers == list(range(1, whole + 1))
    assert recovery.last_sequence == whole
    if size in ends:
        assert cut is None
    else:
        assert cut is not None
        assert cut.after_sequence == whole
        assert cut.kept_as == []
        assert cut.bytes_cut == size - (ends[whole] if size >= ends[0] else 0)
    assert recover(directory)[0] == numbers
    assert recover(directory)[2] is None


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_bit_flipped_tail_is_cut_at_the_last_good_record_and_set_aside(tmp_path: Path, data: st.DataObject) -> None:
    directory = a_directory(tmp_path)
    write(directory, [[1, 2, 3, 4]])
    path = list_segments(directory)[0].path
    ends = record_ends(directory)
    position = data.draw(st.integers(0, ends[-1] - 1))
    content = bytearray(path.read_bytes())
    content[position] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    whole = max(sum(end <= position for end in ends) - 1, 0)
    numbers, _, cut = recover(directory)
    assert numbers == list(range(1, whole + 1))
    assert cut is not None
    assert cut.after_sequence == whole
    kept = b"".join((directory / name).read_bytes() for name in cut.kept_as)
    assert kept == bytes(content[cut.at_byte :])


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(garbage=st.binary(min_size=1, max_size=400))
def test_anything_behind_the_last_record_is_cut(tmp_path: Path, garbage: bytes) -> None:
    directory = a_directory(tmp_path)
    write(directory, [[1, 2]])
    with list_segments(directory)[0].path.open("ab") as file:
        file.write(garbage)
    numbers, _, cut = recover(directory)
    assert numbers == [1, 2]
    assert cut is not None
    assert cut.bytes_cut == len(garbage)


@pytest.mark.parametrize("damaged", [0, 1, 2])
def test_damage_in_an_earlier_segment_sets_the_later_ones_aside(fresh: Path, damaged: int) -> None:
    write(fresh, [[n] for n in range(1, 9)], segment_bytes=300)
    segments = list_segments(fresh)
    path = segments[damaged].path
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    numbers, recovery, cut = recover(fresh)
    assert numbers == list(range(1, segments[damaged + 1].first_sequence - 1))
    assert cut is not None
    assert len(cut.kept_as) == len(segments) - damaged
    assert recovery.last_sequence == len(numbers)


def test_after_a_cut_the_journal_goes_on_behind_the_last_good_record(fresh: Path) -> None:
    write(fresh, [[1, 2, 3]])
    path = list_segments(fresh)[0].path
    os.truncate(path, path.stat().st_size - 5)
    _, recovery, _ = recover(fresh)
    journal = open_journal(fresh, recovery.last_sequence + 1)
    assert journal.write([frame(30), frame(4)]) == 3
    journal.sync()
    journal.close()
    numbers, _, cut = recover(fresh)
    assert (numbers, cut) == ([1, 2, 30, 4], None)


def test_a_journal_that_lies_wholly_before_the_snapshot_is_started_anew(fresh: Path) -> None:
    write(fresh, [[1, 2]])
    numbers, recovery, cut = recover(fresh, after=5)
    assert (numbers, recovery.last_sequence, cut) == ([], 5, None)
    journal = open_journal(fresh, 6)
    journal.write([frame(6)])
    journal.sync()
    journal.close()
    assert recover(fresh, after=5)[0] == [6]


class FailingDisk:
    """Lets `good` calls pass, then fails like a full disk; a failing write first stores a part."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, name: str, good: int) -> None:
        self.left = good
        self._real = getattr(os, name)
        monkeypatch.setattr(f"rayvox_service.{'durable_files' if name == 'pwritev' else 'journal'}.os.{name}", self)

    def __call__(self, descriptor: int, *arguments: object) -> object:
        self.left -= 1
        if self.left >= 0:
            return self._real(descriptor, *arguments)
        if self.left < -1 and len(arguments) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        if len(arguments) == 2:
            buffers, offset = arguments
            assert isinstance(buffers, list)
            return self._real(descriptor, [buffers[0][:10]], offset)
        raise OSError(errno.EIO, "Input/output error")


def test_a_full_disk_leaves_the_journal_as_it_was(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = open_journal(fresh)
    journal.write([frame(1)])
    journal.sync()
    with monkeypatch.context() as broken:
        FailingDisk(broken, "pwritev", 0)
        with pytest.raises(OSError, match="No space"):
            journal.write([frame(9), frame(10)])
    assert journal.write([frame(2)]) == 2
    journal.sync()
    journal.close()
    numbers, _, cut = recover(fresh)
    assert (numbers, cut) == ([1, 2], None)


def test_a_failed_sync_takes_back_what_it_was_for(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(fresh, 1, segment_bytes=LARGE, fsync=True)
    journal.write([frame(1)])
    journal.sync()
    journal.write([frame(9)])
    with monkeypatch.context() as broken:
        FailingDisk(broken, "fdatasync", 0)
        with pytest.raises(OSError, match="Input/output"):
            journal.sync()
    assert recover(fresh)[0] == [1]
    assert journal.write([frame(2)]) == 2
    journal.sync()
    journal.close()
    assert recover(fresh)[0] == [1, 2]


def test_nothing_is_written_behind_bytes_that_could_not_be_taken_back(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = open_journal(fresh)
    journal.write([frame(1)])
    journal.sync()

    def refuse(*arguments: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    with monkeypatch.context() as broken:
        broken.setattr("rayvox_service.journal.os.ftruncate", refuse)
        FailingDisk(broken, "pwritev", 0)
        for _ in range(2):
            with pytest.raises(OSError, match="Input/output"):
                journal.write([frame(9)])
    assert journal.write([frame(2)]) == 2
    journal.sync()
    journal.close()
    assert recover(fresh)[0] == [1, 2]


def test_a_segment_that_cannot_be_started_leaves_the_last_one_in_use(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = open_journal(fresh, segment_bytes=100)
    journal.write([frame(1)])
    journal.sync()
    with monkeypatch.context() as broken:
        FailingDisk(broken, "pwritev", 0)
        with pytest.raises(OSError, match="No space"):
            journal.write([frame(9)])
    assert len(list_segments(fresh)) == 1
    journal.write([frame(2)])
    journal.sync()
    journal.close()
    assert recover(fresh)[0] == [1, 2]
