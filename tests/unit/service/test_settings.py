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
