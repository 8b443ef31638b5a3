from __future__ import annotations

import errno
import gc
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest
from rayvox_service.map_config import MapConfig
from rayvox_service.map_store import MapStore
from rayvox_service.problems import Problem
from rayvox_service.settings import Settings

LAB = MapConfig(name="lab", resolution_m=0.1)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[MapStore]:
    opened = MapStore(Settings(data_dir=tmp_path))
    opened.open_all()
    yield opened
    opened.stop_opening()
    opened.close()


def test_a_map_whose_journal_cannot_be_started_is_not_half_there(
    store: MapStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("rayvox_service.hosted_map.Journal", refuse)
        with pytest.raises(OSError, match="No space"):
            store.create(LAB)
    with pytest.raises(Problem, match="no map lab"):
        store.get("lab")
    assert not any((tmp_path / "maps").iterdir())
    assert store.create(LAB) is store.get("lab")


def test_a_created_map_is_on_disk_as_a_whole(store: MapStore, tmp_path: Path) -> None:
    store.create(LAB)
    assert {path.suffix for path in (tmp_path / "maps" / "lab").iterdir()} == {".json", ".journal"}
    assert not any((tmp_path / "staging").iterdir())


def test_a_deleted_map_leaves_nothing_behind(store: MapStore, tmp_path: Path) -> None:
    store.create(LAB)
    store.delete("lab")
    assert not any((tmp_path / "maps").iterdir())
    assert not any((tmp_path / "trash").iterdir())


def test_a_deleted_maps_memory_is_free_at_once(store: MapStore) -> None:
    gc.disable()
    try:
        hosted = weakref.ref(store.create(LAB))
        store.delete("lab")
        assert hosted() is None
    finally:
        gc.enable()


def test_maps_that_are_still_being_restored_say_so(store: MapStore, tmp_path: Path) -> None:
    store.create(LAB)
    store.stop_opening()
    store.close()
    again = MapStore(Settings(data_dir=tmp_path))
    try:
        assert not again.ready
        for use in (again.get, again.delete):
            with pytest.raises(Problem, match="being restored"):
                use("lab")
        again.open_all()
        assert again.ready
        assert again.get("lab").config == LAB
    finally:
        again.stop_opening()
        again.close()


def test_start_up_removes_what_a_crash_left_behind_and_not_what_is_under_way(tmp_path: Path) -> None:
    for name in ("staging/old", "trash/old"):
        (tmp_path / name).mkdir(parents=True)
    store = MapStore(Settings(data_dir=tmp_path))
    for name in ("staging/new", "trash/new"):
        (tmp_path / name).mkdir()
    store.open_all()
    store.close()
    assert [path.name for path in (*(tmp_path / "staging").iterdir(), *(tmp_path / "trash").iterdir())] == ["new"] * 2
