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

    @property
    def sides(self) -> tuple[tuple[tuple[int, int], str], tuple[tuple[int, int], str]]:
        """The stretches, each with the name of its sequence."""
        return (self.first, self.one), (self.second, self.other)

    @property
    def turned(self) -> "Decision":
        """The same with its sides changed."""
        return replace(
            self,
            one=self.other,
            other=self.one,
            first=self.second,
            second=self.first,
            lengths=(self.lengths[1], self.lengths[0]),
        )

    def about(self, other: "Decision") -> bool:
        """True if two decisions, either way round, are about stretches of the same sequences with views in common."""
        return any(
            (self.one, self.other) == (its.one, its.other)
            and _meet(self.first, its.first)
            and _meet(self.second, its.second)
            for its in (other, other.turned)
        )


def _meet(mine: tuple[int, int], its: tuple[int, int]) -> bool:
    return mine[0] <= its[1] and its[0] <= mine[1]


Confirm = Callable[[Decision], Decision]
"""A person's word on a decision: the same, or one turned round (M8)."""


def leave_it(decision: Decision) -> Decision:
    """Nobody is asked."""
    return decision


def wished(decision: Decision, wishes: Sequence[Decision]) -> Decision:
    """A decision as the first wish about the same stretch has it."""
    wish = next((wish for wish in wishes if wish.about(decision)), None)
    return decision if wish is None else replace(decision, joined=wish.joined, why=wish.why)
