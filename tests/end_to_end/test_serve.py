from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

from tests.support.service_process import MAIN, ServiceProcess


def serve(**settings: object) -> subprocess.CompletedProcess[str]:
    """A service that is expected not to start."""
    variables = {f"RAYVOX_{name.upper()}": str(value) for name, value in settings.items()}
    return subprocess.run(
        [sys.executable, "-c", MAIN], env=variables, capture_output=True, text=True, timeout=60, check=False
    )


def test_an_open_address_without_a_key_is_refused_in_clear_words(tmp_path: Path) -> None:
    ended = serve(data_dir=tmp_path / "data", host="0.0.0.0", port=0)
    assert ended.returncode != 0
    assert "set an API key (RAYVOX_API_KEY) or use 127.0.0.1" in ended.stderr
    assert not (tmp_path / "data").exists()


def test_a_data_directory_in_use_is_named(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path):
        ended = serve(data_dir=tmp_path, port=0)
    assert ended.returncode != 0
    assert f"{tmp_path} is in use by another rayvox service" in ended.stderr


def test_a_port_in_use_is_an_error_before_anything_is_touched(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        ended = serve(data_dir=tmp_path / "data", port=taken.getsockname()[1])
    assert ended.returncode != 0
    assert "Address already in use" in ended.stderr
    assert not (tmp_path / "data").exists()
