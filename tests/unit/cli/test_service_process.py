"""The service as a child process."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from rayvox_client import Client, ConnectionFailedError
from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.service_process import ServiceProcess


def test_the_service_is_up_inside_and_gone_after(tmp_path: Path) -> None:
    with ServiceProcess(tmp_path / "data", 0) as service:
        assert Client(service.url).health() == "ok"
    with pytest.raises(ConnectionFailedError):
        Client(service.url, retries=0).health()


def test_a_taken_port_is_left_alone(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert ServiceProcess(tmp_path, port).port != port


def test_a_service_that_cannot_start_leaves_its_last_words(tmp_path: Path) -> None:
    with (
        ServiceProcess(tmp_path / "data", 0),
        pytest.raises(CommandError, match=r"the service did not start; .+"),
        ServiceProcess(tmp_path / "data", 0),
    ):
        pytest.fail("two services on one data folder")


def test_a_data_folder_that_is_a_file_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("")
    with pytest.raises(CommandError, match="cannot write to"), ServiceProcess(tmp_path / "data", 0):
        pytest.fail("started on a file")
