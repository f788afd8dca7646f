"""Notes about a merged map: parts that nothing joins, odometers of other scales, joins that others contradict."""

from collections.abc import Iterator, Sequence

from refseq.atlas.decision import Decision
from refseq.atlas.merge import Merged
from refseq.atlas.routes import islands
from refseq.atlas.scans import LONG
from refseq.map.growth.adding import ROBOT
from refseq.map.map import Map
from refseq_bench.scenarios.maps.checks import in_words
from refseq_bench.scenarios.tables import plural

STRETCHED = 0.07
"""Share by which two odometers may differ in length; more is told. Those of our robots differ by 2 %."""
STRAINED = "joined as a person says, though odometry and the other joins contradict it"
OVERRULED = "refused as it contradicts a person's joins, and would be joined without these"
CONTESTED = "refused, as others that contradict it would agree nearly as well: --page shows it, and --decisions decides"


def merge_notes(merged: Merged, maps: Sequence[Map], machines: Sequence[Decision] = ()) -> list[str]:
    """Notes about a map that was merged of others, a line each; ``machines`` are a machine's decisions in a file."""
    return [
        *_parts(islands(merged.map)),
        *_robots(maps),
        *_scales(merged.decisions),
        *_each(merged.strained, STRAINED),
        *_each(merged.overruled, OVERRULED),
        *_each(merged.contested, CONTESTED),
        *_unsupported(merged.unsupported),
        *_not_found(machines, merged.decisions, maps),
    ]


def _parts(parts: Sequence[Sequence[str]]) -> Iterator[str]:
    if len(parts) > 1:
        told = "; ".join(", ".join(part) for part in parts)
        yield f"{len(parts)} parts that share no place, no route leads from one to another: {told}"


def _robots(maps: Sequence[Map]) -> Iterator[str]:
    found: dict[str, list[str]] = {}
    for name, sequence in ((name, its) for one in maps for name, its in zip(one.names, one.sequences, strict=True)):
        if robot := sequence.metadata.get(ROBOT):
            found.setdefault(robot, []).append(name)
    if len(found) > 1:
        told = "; ".join(f"{', '.join(names)} by {robot}" for robot, names in found.items())
        yield f"drives of several robots, whose sensors stand elsewhere, so that fewer joins may be found: {told}"


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


def _each(decisions: Sequence[Decision], fate: str) -> Iterator[str]:
    for one in decisions:
        yield f"{in_words(one)} is {fate}"


def _unsupported(decisions: Sequence[Decision]) -> Iterator[str]:
    if decisions:
        are, them = ("are", "them") if len(decisions) > 1 else ("is", "it")
        yield (
            f"{plural(len(decisions), 'stretch')} {are} refused for want of evidence alone: --page shows {them}, and "
            f"--decisions joins {them} where a person knows better"
        )


def _not_found(machines: Sequence[Decision], found: Sequence[Decision], maps: Sequence[Map]) -> Iterator[str]:
    """A machine's decisions about stretches that the search does not give: a person may have changed their views."""
    merged_before = [{path.name for path in one.paths} for one in maps if not one.has_one_path]
    stretches = {one.sides for decision in found for one in (decision, decision.turned)}
    for one in machines:
        if one.sides not in stretches and not any({one.one, one.other} <= names for names in merged_before):
            yield f"{in_words(one)} is no stretch that the search finds, and pins nothing with its line `machine`"
