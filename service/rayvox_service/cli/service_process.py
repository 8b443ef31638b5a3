"""A service in a child process, for as long as a command needs it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.connection import connect

HOST = "127.0.0.1"
START_LIMIT_S = 60.0
STOP_LIMIT_S = 20.0
LOG_NAME = "service.log"


class ServiceProcess:
    """Context manager: `rayvox serve` on the loopback address, its output in `data_dir`/service.log.

    wanted_port: taken where it is free, else (or for 0) any free one is.
    """

    def __init__(self, data_dir: Path, wanted_port: int) -> None:
        self.data_dir = data_dir
        self.log = data_dir / LOG_NAME
        self.port = wanted_port if wanted_port and _is_free(wanted_port) else _any_free_port()
        self.url = f"http://{HOST}:{self.port}"
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        try:
            self.data_dir.mkdir(parents=True, exist_ok=True)
            log = self.log.open("wb")
        except OSError as error:
            raise CommandError(f"cannot write to {self.data_dir}: {error.strerror}") from error
        flags = ["--host", HOST, "--port", str(self.port), "--data-dir", str(self.data_dir)]
        with log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rayvox_service.cli", "serve", *flags],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        try:
            self._wait_until_ready()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.stop()

    def wait(self) -> None:
        """Until the service ends. Raises CommandError when it ends by itself."""
        if self._process is not None:
            self._process.wait()
            raise CommandError(f"the service has stopped; {self._last_words()}")

    def stop(self) -> None:
        """Let the service finish what it took, then end it."""
        process, self._process = self._process, None
        if process is None or process.poll() is not None:
            return
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(STOP_LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _wait_until_ready(self) -> None:
        from rayvox_client import ConnectionFailedError, ServiceError

        limit = time.monotonic() + START_LIMIT_S
        with connect(self.url, retries=0) as client:
            while time.monotonic() < limit:
                if self._process is None or self._process.poll() is not None:
                    raise CommandError(f"the service did not start; {self._last_words()}")
                try:
                    client.list_maps()
                except (ConnectionFailedError, ServiceError):
                    time.sleep(0.05)
                else:
                    return
        raise CommandError(f"the service did not answer within {START_LIMIT_S:.0f} s; see {self.log}")

    def _last_words(self) -> str:
        lines = self.log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"see {self.log}"


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
        return True


def _any_free_port() -> int:
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
