"""Which pairs of links may touch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError


@dataclass(frozen=True, eq=False)
class AllowedCollisions:
    """Immutable. matrix: (links, links) bool, symmetric, true where a contact is no collision."""

    link_names: tuple[str, ...]
    matrix: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        matrix = np.array(self.matrix, dtype=bool)
        if matrix.shape != (len(self.link_names),) * 2 or (matrix != matrix.T).any():
            raise InvalidInputError(f"an allowed-collision matrix of {len(self.link_names)} links is square, symmetric")
        np.fill_diagonal(matrix, True)
        matrix.flags.writeable = False
        object.__setattr__(self, "matrix", matrix)

    def allows(self, first: str, second: str) -> bool:
        """Raises InvalidInputError for a name that is no link."""
        return bool(self.matrix[self._index(first), self._index(second)])

    def with_allowed(self, pairs: Iterable[tuple[str, str]]) -> AllowedCollisions:
        """These pairs may touch too. Raises InvalidInputError for a name that is no link."""
        return self._with(pairs, True)

    def with_forbidden(self, pairs: Iterable[tuple[str, str]]) -> AllowedCollisions:
        """These pairs may no longer touch. Raises InvalidInputError for a name that is no link."""
        return self._with(pairs, False)

    def with_links(self, names: Sequence[str]) -> AllowedCollisions:
        """For these links: what is known about them is kept, new ones may touch nothing."""
        known = {name: i for i, name in enumerate(self.link_names)}
        matrix = np.eye(len(names), dtype=bool)
        for i, first in enumerate(names):
            for j, second in enumerate(names):
                if first in known and second in known:
                    matrix[i, j] = self.matrix[known[first], known[second]]
        return AllowedCollisions(tuple(names), matrix)

    def _with(self, pairs: Iterable[tuple[str, str]], value: bool) -> AllowedCollisions:
        matrix = self.matrix.copy()
        for first, second in pairs:
            i, j = self._index(first), self._index(second)
            matrix[i, j] = matrix[j, i] = value
        return AllowedCollisions(self.link_names, matrix)

    def _index(self, name: str) -> int:
        try:
            return self.link_names.index(name)
        except ValueError:
            raise InvalidInputError(f"there is no link {name!r}") from None
