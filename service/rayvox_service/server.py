"""Running the service: one process, one event loop, uvicorn in front."""

from __future__ import annotations

import ctypes
import logging
import socket
import sys

import uvicorn

from rayvox_service.app import create_app
from rayvox_service.map_store import MapStore
from rayvox_service.settings import Settings
from rayvox_service.whole_body import WholeBodyProtocol

# Threads of the interpreter hand over after this time at the latest. The default of 5 ms would show in every answer.
SWITCH_INTERVAL_S = 0.0005
GRACEFUL_SHUTDOWN_S = 10
KEEP_ALIVE_S = 60
# glibc's mallopt: blocks up to 8 MiB stay in the heap, and up to 64 MiB of its free end stay mapped.
M_TRIM_THRESHOLD, TRIM_BYTES = -1, 64 << 20
M_MMAP_THRESHOLD, MMAP_BYTES = -3, 8 << 20


class _Server(uvicorn.Server):
    """Says where it listens once it does."""

    def __init__(self, config: uvicorn.Config, url: str) -> None:
        super().__init__(config)
        self._url = url

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            print(f"rayvox listens on {self._url}", flush=True)


def serve(settings: Settings) -> None:
    """Serve until SIGINT or SIGTERM, then finish what was taken. Prints the URL once it answers.

    Raises OSError when the address cannot be bound or the data directory not be written, DataDirectoryInUseError when
    another service has it.
    """
    listener = _listen(settings.host, settings.port)
    store = MapStore(settings)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    _keep_freed_memory()
    config = uvicorn.Config(
        create_app(settings, store),
        loop="uvloop",
        http=WholeBodyProtocol,
        ws="websockets-sansio",
        ws_max_size=settings.max_body_bytes,
        # Point clouds do not shrink under deflate, they only cost time.
        ws_per_message_deflate=False,
        access_log=False,
        log_level=logging.WARNING,
        # A robot that sends a scan every few seconds keeps its connection.
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=GRACEFUL_SHUTDOWN_S,
    )
    host, port = listener.getsockname()[:2]
    server = _Server(config, f"http://{f'[{host}]' if ':' in host else host}:{port}")
    server.run(sockets=[listener])


def _keep_freed_memory() -> None:
    # By default every body of some hundred kilobytes is mapped, faulted in page by page and unmapped again, which
    # takes longer than receiving it: 2.2 ms instead of 0.9 ms of CPU time for 1.2 MB.
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    mallopt(M_MMAP_THRESHOLD, MMAP_BYTES)
    mallopt(M_TRIM_THRESHOLD, TRIM_BYTES)


def _listen(host: str, port: int) -> socket.socket:
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(2048)
    except OSError:
        listener.close()
        raise
    return listener
