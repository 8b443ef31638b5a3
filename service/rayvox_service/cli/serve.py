"""Run the service.

Every setting is a flag here, a RAYVOX_* variable in the environment and a line of a --settings file; the first wins.
"""

from __future__ import annotations

import argparse
import tomllib
from typing import Any

from pydantic import ValidationError

from rayvox_service.cli.command_error import CommandError
from rayvox_service.settings import Settings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One flag per setting."""
    for name, field in Settings.model_fields.items():
        default = field.get_default(call_default_factory=True)
        notes = [field.description or "", f"default {default}" if default is not None else "", f"RAYVOX_{name.upper()}"]
        parser.add_argument(
            f"--{name.replace('_', '-')}", metavar="VALUE", help="; ".join(note for note in notes if note)
        )


def run(arguments: argparse.Namespace) -> int:
    """Serve until the process is told to stop."""
    given = {name: getattr(arguments, name) for name in Settings.model_fields}
    settings = make_settings({name: value for name, value in given.items() if value is not None})
    from rayvox_service.server import serve

    serve(settings)
    return 0


def make_settings(given: dict[str, Any]) -> Settings:
    """Settings from flags and environment. Raises CommandError with one line per wrong value."""
    try:
        return Settings(**given)
    except ValidationError as error:
        complaints = []
        for problem in error.errors():
            name = "_".join(str(part) for part in problem["loc"])
            message = problem["msg"].removeprefix("Value error, ")
            complaints.append(f"--{name.replace('_', '-')}: {message}" if name else message)
        raise CommandError("; ".join(complaints)) from None
    except tomllib.TOMLDecodeError as error:
        raise CommandError(f"the settings file is no TOML: {error}") from None
