"""`rayvox tune` from a folder of scans to a settings file that a service starts with."""

from __future__ import annotations

from pathlib import Path

import pytest
from rayvox.scan_io import Recording
from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.main import main
from rayvox_service.cli.tune import duration_s
from rayvox_service.settings import Settings

from tests.support.tuning_input import small_part


@pytest.mark.parametrize(("text", "seconds"), [("90", 90), ("60s", 60), ("1.5min", 90), ("2m", 120), ("1h", 3600)])
def test_a_budget_is_a_time(text: str, seconds: float) -> None:
    assert duration_s(text) == seconds


@pytest.mark.parametrize("text", ["", "s", "5 parsecs", "0s", "-3", "nan", "inf"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(CommandError, match="--budget"):
        duration_s(text)


def test_a_folder_becomes_settings_that_a_service_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Recording(tmp_path / "scans") as recording:
        for index, scan in enumerate(small_part(1, stations=8).scans):
            recording.write(scan.points, scan.T_map_sensor, float(index))
    words = f"tune {tmp_path / 'scans'} --out {tmp_path / 'out'} --budget 1h --max-error 0.3 --resolutions 0.4,0.2"
    assert main(words.split()) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("For at most 30 cm of error, use ")
    settings_path = tmp_path / "out" / "settings.toml"
    assert f"rayvox serve --settings {settings_path}" in printed
    settings = Settings(settings=settings_path)
    assert settings.map_resolution_m in (0.4, 0.2)
    assert (tmp_path / "out" / "index.html").is_file()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("tune", "name a folder of scans, or --simulate N"),
        ("tune folder --simulate 3", "name a folder of scans, or --simulate N"),
        ("tune nowhere", "no such folder"),
        ("tune --simulate 3 --budget soon", "expected a time"),
        ("tune --simulate 3 --max-error 0", "--max-error must be a number above zero"),
        ("tune --simulate 3 --resolutions fine", "expected metres"),
        ("tune --simulate 0", "at least one seed"),
        ("tune --simulate 3 --robot nowhere.stl", "nowhere.stl"),
    ],
)
def test_what_cannot_be_tuned_is_one_line(words: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
