"""XML without what makes it dangerous: no document type, hence no entities; bounded in depth and elements."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from xml.etree.ElementTree import Element

from rayvox.errors import RayvoxError
from rayvox.mesh_io.load_limits import LoadBudget

MOST_DEPTH = 200
MOST_ELEMENTS = 1_000_000
_CHUNK_BYTES = 1 << 20


class _GuardedBuilder(ElementTree.TreeBuilder):
    def __init__(self, refusal: type[RayvoxError], source: str) -> None:
        super().__init__()
        self._refusal, self._source = refusal, source
        self._depth = self._elements = 0

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise self._refusal(f"{self._source}: documents with a DOCTYPE are not read")

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._depth += 1
        self._elements += 1
        if self._depth > MOST_DEPTH or self._elements > MOST_ELEMENTS:
            raise self._refusal(
                f"{self._source}: XML of more than {MOST_ELEMENTS} elements, or {MOST_DEPTH} within each other"
            )
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag.rpartition("}")[2])


def parse_xml(data: bytes, budget: LoadBudget, refusal: type[RayvoxError], source: str) -> Element:
    """The root element, names without their namespaces. Raises `refusal`, LoadLimitError."""
    parser = ElementTree.XMLParser(target=_GuardedBuilder(refusal, source))
    try:
        for start in range(0, len(data), _CHUNK_BYTES):
            budget.check_time(source)
            parser.feed(data[start : start + _CHUNK_BYTES])
        root: Element = parser.close()
        return root
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        if isinstance(error, RayvoxError):
            raise
        raise refusal(f"{source}: not XML: {error}") from None
