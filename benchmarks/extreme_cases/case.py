"""What a case at an extreme is: what must hold, how ours is measured, and how others do on the same input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """`checked` answers, `wrong` of them; `worst_error` in the case's unit, of those that are not a yes or a no."""

    checked: int
    wrong: int
    worst_error: float = 0.0


# A library's answers, or why it has none.
PeerOutcome = Outcome | str


@dataclass(frozen=True)
class Case:
    """One row of the table. `bound`: the worst error allowed, in `unit`, which is what users are told; 0 is exact."""

    topic: str
    name: str
    must_hold: str
    run: Callable[[], Outcome]
    bound: float = 0.0
    unit: str = ""
    peers: dict[str, Callable[[], PeerOutcome]] = field(default_factory=dict)
    takes_seconds: bool = False
    """Too slow to be repeated for every instruction set, and of no use there."""


def holds(case: Case, outcome: Outcome) -> bool:
    """Whether nothing is wrong and no error exceeds the bound (NaN does)."""
    return bool(outcome.checked > 0 and outcome.wrong == 0 and outcome.worst_error <= case.bound)
