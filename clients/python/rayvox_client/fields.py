"""Typed access to a JSON object that came from the service."""

from __future__ import annotations

import json
from collections.abc import Mapping

from rayvox_client.errors import MalformedAnswerError


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is no JSON number")


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


class Fields:
    """A JSON object whose fields are checked when they are read.

    Raises (all readers): MalformedAnswerError naming the field, when it is missing or of another type.
    """

    __slots__ = ("values", "where")

    def __init__(self, values: Mapping[str, object], where: str) -> None:
        self.values = values
        self.where = where

    @classmethod
    def parse(cls, data: bytes | str, where: str) -> Fields:
        """Read a JSON object; NaN and Infinity are refused as RFC 8259 does."""
        try:
            value = _DECODER.decode(data if isinstance(data, str) else data.decode())
        except (ValueError, RecursionError) as error:
            raise MalformedAnswerError(f"{where} is not JSON: {error}") from error
        if not isinstance(value, dict):
            raise MalformedAnswerError(f"{where} is not a JSON object but {type(value).__name__}")
        return cls(value, where)

    def _wrong(self, name: str, wanted: str) -> MalformedAnswerError:
        if name not in self.values:
            return MalformedAnswerError(f"{self.where}: field {name!r} is missing")
        return MalformedAnswerError(f"{self.where}: {name} = {self.values[name]!r:.100} is not {wanted}")

    def has(self, name: str) -> bool:
        """Whether the field is there and not null."""
        return self.values.get(name) is not None

    def text(self, name: str) -> str:
        value = self.values.get(name)
        if not isinstance(value, str):
            raise self._wrong(name, "a string")
        return value

    def integer(self, name: str) -> int:
        value = self.values.get(name)
        if not isinstance(value, int) or isinstance(value, bool):
            raise self._wrong(name, "an integer")
        return value

    def number(self, name: str) -> float:
        value = self.values.get(name)
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise self._wrong(name, "a number")
        return float(value)

    def boolean(self, name: str) -> bool:
        value = self.values.get(name)
        if not isinstance(value, bool):
            raise self._wrong(name, "true or false")
        return value

    def optional_integer(self, name: str) -> int | None:
        return self.integer(name) if self.has(name) else None

    def nested(self, name: str) -> Fields:
        value = self.values.get(name)
        if not isinstance(value, dict):
            raise self._wrong(name, "an object")
        return Fields(value, f"{self.where}.{name}")

    def list_of(self, name: str) -> list[Fields]:
        value = self.values.get(name)
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise self._wrong(name, "a list of objects")
        return [Fields(item, f"{self.where}.{name}[{i}]") for i, item in enumerate(value)]
