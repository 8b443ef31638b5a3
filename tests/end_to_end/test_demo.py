"""The first thing that a user runs, and then the commands that it proposes."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from rayvox import OccupancyMap

RAYVOX = [sys.executable, "-m", "rayvox_service.cli"]
SHORT = ["demo", "--stations", "5", "--resolution", "0.1", "--port", "0"]


def heed_interrupts() -> None:
    """Shells start what runs in the background with SIGINT ignored, and children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def rayvox(folder: Path, *arguments: str) -> str:
    result = subprocess.run([*RAYVOX, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_demo_maps_the_run_answers_and_ends_with_exit(tmp_path: Path) -> None:
    output = rayvox(tmp_path, *SHORT, "--exit")
    assert re.search(r"^upload +7 scans with [\d,]+ points", output, re.MULTILINE)
    counts = re.search(r"120 robot-sized boxes along the drive: +(\d+) free +(\d+) occupied +(\d+) unknown", output)
    assert counts is not None
    free, occupied, unknown = (int(count) for count in counts.groups())
    assert free + occupied + unknown == 120
    assert free > 30
    assert "at revision 7, 0.1 m cells" in output
    url = re.search(r"http://[\d.:]+", output)
    assert url is not None
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(f"{url[0]}/v1/health", timeout=5)


@pytest.fixture(scope="module")
def left_up(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """A demo whose service is up, with its folder and URL; at the end Ctrl-C must stop both."""
    folder = tmp_path_factory.mktemp("demo")
    command = [*RAYVOX, *SHORT, "--record", "scans"]
    with (
        (folder / "progress").open("wb") as progress,
        subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=progress,
            text=True,
            preexec_fn=heed_interrupts,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            url = ""
            for line in process.stdout:
                url = url or next(iter(re.findall(r"http://[\d.:]+", line)), "")
                if "Ctrl-C stops it" in line:
                    break
            assert url, (folder / "progress").read_text()
            yield folder, url
        finally:
            process.send_signal(signal.SIGINT)
            try:
                status = process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
    assert status == 0
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(f"{url}/v1/health", timeout=5)


def test_the_service_stays_up_at_its_url(left_up: tuple[Path, str]) -> None:
    _, url = left_up
    with urllib.request.urlopen(f"{url}/v1/maps", timeout=5) as answer:
        maps = json.load(answer)["maps"]
    assert [(item["name"], item["scans_applied"]) for item in maps if item["name"] == "demo"] == [("demo", 7)]


def test_info_shows_the_map_and_its_statistics(left_up: tuple[Path, str]) -> None:
    folder, url = left_up
    assert re.search(r"^  demo +0\.1 m  revision 7  scans 7", rayvox(folder, "info", "--url", url), re.MULTILINE)
    assert re.search(r"^occupied +[\d,]+ leaves", rayvox(folder, "info", "demo", "--url", url), re.MULTILINE)


def test_an_exported_map_loads_with_the_leaves_that_info_counts(left_up: tuple[Path, str]) -> None:
    folder, url = left_up
    rayvox(folder, "export", "demo", "demo.ot", "--url", url)
    loaded = OccupancyMap.load(folder / "demo.ot")
    assert f"{loaded.statistics().occupied_leaves:,} leaves" in rayvox(folder, "info", "demo", "--url", url)
    assert loaded.statistics().occupied_leaves > 1000
    assert f"{loaded.statistics().occupied_leaves:,} leaves" in rayvox(folder, "info", "demo.ot")


def test_recorded_scans_go_up_once_however_often_they_are_uploaded(left_up: tuple[Path, str]) -> None:
    folder, url = left_up
    upload = ("upload", "again", "scans", "--resolution", "0.1", "--url", url)
    assert "7 scans" in rayvox(folder, *upload)
    before = rayvox(folder, "info", "again", "--url", url)
    assert "7 there already" in rayvox(folder, *upload, "--via", "http")
    assert rayvox(folder, "info", "again", "--url", url) == before


def test_a_compressed_upload_makes_the_same_map(left_up: tuple[Path, str]) -> None:
    folder, url = left_up
    for name, options in (("raw", []), ("compressed", ["--zstd"])):
        rayvox(folder, "upload", name, "scans", "--resolution", "0.1", *options, "--url", url)
        rayvox(folder, "export", name, f"{name}.ot", "--url", url)
    assert (folder / "raw.ot").read_bytes() == (folder / "compressed.ot").read_bytes()
