"""What somebody who merged maps should know of the result: parts that nothing joins, odometers' scales, strained joins."""

from collections.abc import Iterator, Sequence

from refseq.atlas.decision import Decision
from refseq.atlas.merge import Merged
from refseq.atlas.routes import islands
from refseq_bench.scenarios.maps.checks import in_words

LONG = 15.0
"""Stretches from so many metres on tell how odometers' scales go together: a view more or less is 6 % of it."""
STRETCHED = 0.07
"""Share by which two odometers may differ in length; more is told. Those of the bench's robots differ by 2 % at most."""


def merge_notes(merged: Merged) -> list[str]:
    """Notes about a merged map, a line each."""
    return [*_parts(islands(merged.map)), *_scales(merged.decisions), *_strained(merged.strained)]


def _parts(parts: Sequence[Sequence[str]]) -> Iterator[str]:
    if len(parts) > 1:
        told = "; ".join(", ".join(part) for part in parts)
        yield f"{len(parts)} parts that share no place, no route leads from one to another: {told}"


def _scales(decisions: Sequence[Decision]) -> Iterator[str]:
    """Pairs of paths whose odometers tell other lengths of one stretch, by the longest of it."""
    longest: dict[tuple[str, str], Decision] = {}
    for one in sorted(decisions, key=lambda decision: min(decision.lengths)):
        if one.joined and min(one.lengths) >= LONG and one.one != one.other:
            longest[one.one, one.other] = one
    for (name, other), one in longest.items():
        length, its = one.lengths
        if abs(its / length - 1) > STRETCHED:
            yield (
                f"the odometry of {other} shows {its / length:.2f} m for each metre by that of {name} "
                f"({in_words(one)}): one of them has another scale"
            )


def _strained(decisions: Sequence[Decision]) -> Iterator[str]:
    for one in decisions:
        yield f"{in_words(one)} is joined as a person says, though odometry and the other joins contradict it"
