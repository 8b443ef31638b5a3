"""The command line's failures: one line, no traceback."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
import pytest
from rayvox_service.cli.main import main
from rayvox_service.settings import Settings


def failure(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(arguments) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1, captured.err
    return captured.err


def unused_url() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"http://127.0.0.1:{probe.getsockname()[1]}"


def test_an_open_address_without_a_key_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RAYVOX_API_KEY", raising=False)
    line = failure(capsys, "serve", "--host", "0.0.0.0")
    assert line.startswith("rayvox serve: host 0.0.0.0 can be reached from other machines")


def test_a_setting_that_is_no_number_names_its_flag(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--port: " in failure(capsys, "serve", "--port", "http")
    assert "--queue-bytes: " in failure(capsys, "serve", "--queue-bytes", "-1")


def test_every_setting_is_a_flag_of_serve(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["serve", "--help"])
    text = capsys.readouterr().out
    for name in Settings.model_fields:
        assert f"--{name.replace('_', '-')} " in text
        assert f"RAYVOX_{name.upper()}" in text


def test_a_service_that_is_not_there_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    url = unused_url()
    line = failure(capsys, "info", "--url", url)
    assert url.removeprefix("http://") in line


def test_an_unknown_map_format_is_refused_before_anything_is_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert "known are .bt .ot .ply" in failure(capsys, "export", "lab", "lab.obj", "--url", "http://127.0.0.1:1")


def test_a_missing_folder_for_the_export_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert "no such folder" in failure(capsys, "export", "lab", str(tmp_path / "absent" / "lab.bt"))


def test_a_corrupt_map_file_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "map.bt").write_bytes(b"not a map")
    failure(capsys, "info", str(tmp_path / "map.bt"))
    failure(capsys, "info", str(tmp_path / "absent.bt"))


def test_scans_without_a_pose_file_are_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert "no scans in it" in failure(capsys, "upload", "lab", str(tmp_path))
    np.save(tmp_path / "0.npy", np.ones((1, 3)))
    assert "name one with --poses" in failure(capsys, "upload", "lab", str(tmp_path))


@pytest.mark.parametrize("text", ["1,2,3", "a,b,c,d", "1,2,3,4,5"])
def test_intrinsics_that_are_not_four_numbers_are_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, text: str
) -> None:
    (tmp_path / "0.png").write_bytes(b"")
    (tmp_path / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    assert "four numbers" in failure(capsys, "upload", "lab", str(tmp_path), "--intrinsics", text)


def test_no_command_is_wrong_usage() -> None:
    with pytest.raises(SystemExit) as caught:
        main([])
    assert caught.value.code == 2
