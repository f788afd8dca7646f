"""Maps to be merged and decisions about them, checked before any is merged."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.errors import MapError
from refseq.map.map import Map, check_names
from refseq.map.sequence import check_comparable
from refseq_bench.scenarios.drives.inputs import read_map
from refseq_bench.scenarios.errors import ScenarioError

SAME = 2.0
"""Views that joins lead to within so many of each other are one: a person counts no nearer."""
NONE_LOADED: Mapping[Path, Map] = MappingProxyType({})
ROUNDED = 0.02
"""Lengths in a file of decisions are those of the maps within so much [m]."""


def read_maps(
    paths: Sequence[Path],
    decisions: Sequence[Decision] = (),
    machines: Sequence[Decision] = (),
    *,
    first_of_one_path: bool = False,
    loaded: Mapping[Path, Map] = NONE_LOADED,
) -> list[Map]:
    """Read maps that can be merged; all but the first have one path, unless that is asked of the first as well.

    Those that are ``loaded`` are not read once more.

    Decisions of a machine in a person's file pin nothing, but have to be about these maps all the same: else a stretch
    that the person changed in one would be passed over.

    Raises ``MapError`` for a file that is no such map or does not go with the first, ``ScenarioError`` for a file that
    is not there, before any is read, and for decisions about what is not there.
    """
    for path in paths:
        if not path.exists():
            raise ScenarioError(f"{path}: cannot be read: No such file or directory")
    if first_of_one_path or len({path.stem for path in paths[1:]}) < len(paths[1:]):
        check_names([path.stem for path in paths])
    first, *others = maps = [loaded[path] if path in loaded else read_map(path) for path in paths]
    for path, one in zip(paths, maps, strict=True):
        if not one.has_one_path and (first_of_one_path or one is not first):
            raise MapError(f"{path}: is a map of several paths; valid is a map of one")
    views = [(path.name, len(path)) for one in maps for path in one.paths]
    check_names([name for name, _ in views])
    named = [*decisions, *machines]
    _check_names_of(named, [name for name, _ in views])
    for path, other in zip(paths[1:], others, strict=True):
        try:
            check_comparable(first.sequences[0], other.sequence)
        except MapError as error:
            raise MapError(f"{path}: {error}") from error
    _check_views_of(named, dict(views))
    _check_lengths_of(named, {path.name: path.along for one in maps for path in one.paths})
    check_agreeing(decisions)
    return maps


def _check_names_of(decisions: Sequence[Decision], known: Sequence[str]) -> None:
    for decision in decisions:
        for name in (decision.one, decision.other):
            if name not in known:
                raise ScenarioError(f"decisions: sequence {name!r} is unknown; valid are {', '.join(known)}")


def check_agreeing(decisions: Sequence[Decision]) -> None:
    """Raise ``ScenarioError`` for decisions of which not all can hold.

    One stretch is joined and refused; or it is refused, and two joins over a third path lead from its one side to the
    other all the same.
    """
    for number, one in enumerate(decisions):
        for other in decisions[:number]:
            if one.about(other) and one.joined is not other.joined:
                raise ScenarioError(
                    f"decisions: {in_words(one)} is joined and refused; valid is one decision about a stretch"
                )
    joins = [way for decision in decisions if decision.joined for way in (decision, decision.turned)]
    for refused in (decision for decision in decisions if not decision.joined):
        for first in (join for join in joins if join.one == refused.one and join.other != refused.other):
            for second in (join for join in joins if (join.one, join.other) == (first.other, refused.other)):
                if _lead(first, second, refused):
                    raise ScenarioError(
                        f"decisions: {in_words(refused)} is refused, but {in_words(first)} and {in_words(second)} are "
                        "joined, which makes them one; valid are decisions that agree"
                    )


def in_order(decisions: Sequence[Decision], maps: Sequence[Map]) -> list[Decision]:
    """Decisions with the path first that is merged first, whatever order they were made in."""
    order = [path.name for one in maps for path in one.paths]
    return [one if order.index(one.one) <= order.index(one.other) else one.turned for one in decisions]


def check_made(decisions: Sequence[Decision], by_a_person: str) -> None:
    """Raise ``ScenarioError`` where what was joined makes one of what a person refused.

    ``by_a_person`` is the reason of a person's decisions: a machine that refuses a join may only know too little of it.
    """
    check_agreeing([one for one in decisions if one.joined or one.why == by_a_person])


def in_words(decision: Decision) -> str:
    """The stretches of a decision."""
    return " = ".join(f"{name} {first}-{last}" for (first, last), name in decision.sides)


def _lead(first: Decision, second: Decision, to: Decision) -> bool:
    """True where two joins lead a view of a stretch to the other side of it, view by view in proportion."""

    def across(view: float, one: tuple[int, int], other: tuple[int, int]) -> float:
        return other[0] + (view - one[0]) * (other[1] - other[0]) / max(one[1] - one[0], 1)

    for view in range(max(first.first[0], to.first[0]), min(first.first[1], to.first[1]) + 1):
        there = across(view, first.first, first.second)
        if second.first[0] <= there <= second.first[1]:
            end = across(there, second.first, second.second)
            if abs(end - across(view, to.first, to.second)) <= SAME and to.second[0] <= end <= to.second[1]:
                return True
    return False


def _check_views_of(decisions: Sequence[Decision], views: Mapping[str, int]) -> None:
    """Tell of decisions that nothing would ever be decided by; ``views`` are those of each path."""
    for decision in decisions:
        if decision.one == decision.other and decision.first[1] >= decision.second[0]:
            raise ScenarioError(
                f"decisions: {in_words(decision)} is one path that comes back to itself; valid is an earlier stretch, "
                "then a later one"
            )
        for (first, last), name in decision.sides:
            if last >= views[name]:
                raise ScenarioError(
                    f"decisions: {name!r} has no views {first} to {last}; valid are 0 to {views[name] - 1}"
                )


def _check_lengths_of(decisions: Sequence[Decision], along: Mapping[str, NDArray[np.float64]]) -> None:
    """Tell of decisions about paths of other maps that have the same names; ``along`` (V,) [m] are those of each."""
    for decision in (one for one in decisions if any(one.lengths)):
        for ((first, last), name), told in zip(decision.sides, decision.lengths, strict=True):
            length = float(along[name][last] - along[name][first])
            if abs(length - told) > ROUNDED:
                raise ScenarioError(
                    f"decisions: views {first} to {last} of {name!r} are {length:.2f} m, and lengths_m says "
                    f"{told:.2f}: it was written for other maps; valid are decisions about these, or a join without "
                    "lengths_m where you changed its views"
                )
