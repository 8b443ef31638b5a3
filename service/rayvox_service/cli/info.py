"""Show the service and its maps, one map with its statistics, or a .bt/.ot file."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

from rayvox_service.cli.connection import add_connection_arguments, connect
from rayvox_service.cli.map_report import byte_text, statistics_lines

MAP_FILE_SUFFIXES = (".bt", ".ot")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to show."""
    parser.add_argument("map", nargs="?", help="a map's name or a .bt/.ot file; without it, the service and its maps")
    add_connection_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print it."""
    if arguments.map is None:
        _show_service(arguments.url, arguments.api_key)
    elif Path(arguments.map).suffix.lower() in MAP_FILE_SUFFIXES:
        _show_file(Path(arguments.map))
    else:
        _show_map(arguments.url, arguments.api_key, arguments.map)
    return 0


def _show_service(url: str, api_key: str | None) -> None:
    with connect(url, api_key) as client:
        version, maps = client.version(), client.list_maps()
    print(f"{url}: service {version.service}, kernel {version.kernel}, API {version.api}; maps: {len(maps)}")
    for item in maps:
        waiting = item.scans_acknowledged - item.scans_applied
        print(
            f"  {item.name:<24} {item.resolution_m:g} m  revision {item.revision}  scans {item.scans_applied}"
            f"{f' (+{waiting} waiting)' if waiting else ''}  {byte_text(item.memory_bytes)}"
        )


def _show_map(url: str, api_key: str | None, name: str) -> None:
    with connect(url, api_key) as client:
        item = client.map_info(name, statistics=True)
    print(f"{item.name}: {item.resolution_m:g} m cells, {item.depth} levels, revision {item.revision}")
    print(f"{'scans':<10}{item.scans_applied:>12,} applied of {item.scans_acknowledged:,} acknowledged")
    for line in statistics_lines(item.statistics or {}):
        print(line)


def _show_file(path: Path) -> None:
    from rayvox import OccupancyMap

    loaded = OccupancyMap.load(path)
    print(f"{path}: {loaded.resolution_m:g} m cells, {loaded.depth} levels")
    statistics = loaded.statistics()
    fields = dataclasses.asdict(statistics) if dataclasses.is_dataclass(statistics) else dict(vars(statistics))
    for line in statistics_lines(fields):
        print(line)
