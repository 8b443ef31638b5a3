from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError
from rayvox import EngineUnavailableError
from rayvox_service import map_store
from rayvox_service.map_store import DataDirectoryInUseError, MapStore
from rayvox_service.settings import Settings


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "robot.local", "8.8.8.8", ""])
def test_an_address_that_others_can_reach_is_refused_without_a_key(host: str) -> None:
    with pytest.raises(ValidationError, match="API key"):
        Settings(host=host)
    assert Settings(host=host, api_key="secret").host == host  # type: ignore[arg-type]  # pydantic wraps it


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost", "127.1.2.3"])
def test_loopback_needs_no_key(host: str) -> None:
    assert Settings(host=host).api_key is None


def test_an_empty_key_is_no_key() -> None:
    with pytest.raises(ValidationError, match="empty"):
        Settings(host="0.0.0.0", api_key="")  # type: ignore[arg-type]  # pydantic wraps it


def test_settings_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYVOX_PORT", "9999")
    monkeypatch.setenv("RAYVOX_FSYNC", "false")
    monkeypatch.setenv("RAYVOX_ENGINE", "beam")
    settings = Settings()
    assert (settings.port, settings.fsync, settings.engine, settings.host) == (9999, False, "beam", "127.0.0.1")
    assert "secret" not in repr(Settings(api_key="secret"))  # type: ignore[arg-type]  # pydantic wraps it


@pytest.mark.parametrize(
    ("name", "value"), [("port", -1), ("port", 70_000), ("max_points", 0), ("queue_bytes", -1), ("engine", "fastest")]
)
def test_limits_that_cannot_work_are_refused(name: str, value: int) -> None:
    with pytest.raises(ValidationError):
        Settings(**{name: value})  # type: ignore[arg-type]


def test_an_engine_that_is_not_installed_is_refused_before_the_data_directory_is_taken(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing() -> str:
        raise EngineUnavailableError("pip install embreex")

    monkeypatch.setattr(map_store, "load_embree", missing)
    with pytest.raises(EngineUnavailableError, match="embreex"):
        MapStore(Settings(data_dir=tmp_path / "data", engine="embree"))
    assert not (tmp_path / "data").exists()


def test_a_data_directory_serves_one_service_at_a_time(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path / "deep" / "down")
    store = MapStore(settings)
    with pytest.raises(DataDirectoryInUseError, match="in use"):
        MapStore(settings)
    store.stop_opening()
    store.close()
    again = MapStore(settings)
    again.stop_opening()
    again.close()


def test_a_settings_file_gives_way_to_the_environment_and_that_to_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "settings.toml"
    path.write_text('engine = "dda"\nmap_resolution_m = 0.2\nmap_ray_share = 0.5\nport = 1\n')
    monkeypatch.setenv("RAYVOX_MAP_RAY_SHARE", "0.25")
    monkeypatch.setenv("RAYVOX_PORT", "2")
    settings = Settings(settings=path, port=3)
    assert (settings.engine, settings.map_resolution_m) == ("dda", 0.2)
    assert (settings.map_ray_share, settings.port) == (0.25, 3)
    monkeypatch.setenv("RAYVOX_SETTINGS", str(path))
    assert Settings().engine == "dda"


@pytest.mark.parametrize("text", ["surprise = 1\n", "map_ray_share = 0\n", 'collision_unknown = "perhaps"\n'])
def test_a_settings_file_that_cannot_be_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "settings.toml"
    path.write_text(text)
    with pytest.raises(ValidationError):
        Settings(settings=path)


def test_a_settings_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"absent\.toml: no such settings file"):
        Settings(settings=tmp_path / "absent.toml")
