"""Decisions about joins: made or refused, why, and a person's word on them (M8)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Decision:
    """A stretch that two sequences seem to share, by the places' numbers in the sequences as they were learnt.

    ``one`` comes first among the paths that are merged, ``other`` later; ``first`` and ``second`` are the stretches,
    first and last place. ``joined`` says whether they were made one, and ``why`` why or why not.
    """

    one: str
    other: str
    first: tuple[int, int]
    second: tuple[int, int]
    lengths: tuple[float, float]
    joined: bool
    why: str

    def about(self, other: "Decision") -> bool:
        """True if two decisions are about stretches of the same sequences that have views in common."""
        pairs = (self.first, other.first), (self.second, other.second)
        return (self.one, self.other) == (other.one, other.other) and all(
            mine[0] <= its[1] and its[0] <= mine[1] for mine, its in pairs
        )


Confirm = Callable[[Decision], Decision]
"""A person's word on a decision: the same, or one turned round (M8)."""


def leave_it(decision: Decision) -> Decision:
    """Nobody is asked."""
    return decision


def wished(decision: Decision, wishes: Sequence[Decision]) -> Decision:
    """A decision as the first wish about the same stretch has it."""
    wish = next((wish for wish in wishes if wish.about(decision)), None)
    return decision if wish is None else replace(decision, joined=wish.joined, why=wish.why)
