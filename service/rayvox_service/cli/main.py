"""`rayvox`: parse, run one command, turn every expected failure into one line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from rayvox.errors import RayvoxError

from rayvox_service.cli import demo, export, info, serve, tune, upload
from rayvox_service.cli.command_error import CommandError

_COMMANDS = {"serve": serve, "upload": upload, "export": export, "info": info, "tune": tune, "demo": demo}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status: 0 done, 1 failed with one line on stderr, 2 wrong usage."""
    parsed = _parser().parse_args(arguments)
    try:
        return int(_COMMANDS[parsed.command].run(parsed))
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        # Whoever read the output has seen enough, as in `rayvox info | head`.
        sys.stderr.close()
        return 1
    except (CommandError, RayvoxError, OSError) as error:
        print(f"rayvox {parsed.command}: {error}", file=sys.stderr)
        return 1
    except Exception as error:
        if not _is_client_error(error):
            raise
        print(f"rayvox {parsed.command}: {error}", file=sys.stderr)
        return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="rayvox", description="Occupancy maps of robot scans, as a service.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in _COMMANDS.items():
        summary = (command.__doc__ or "").partition("\n")[0]
        command.add_arguments(commands.add_parser(name, help=summary, description=summary))
    return parser


def _is_client_error(error: Exception) -> bool:
    """Whether the client raised it; the client is only imported by the commands that talk to a service."""
    module = sys.modules.get("rayvox_client")
    return module is not None and isinstance(error, module.RayvoxClientError)
