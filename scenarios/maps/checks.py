"""Maps to be merged and decisions about them, checked before any is merged."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from refseq.atlas.decision import Decision
from refseq.errors import MapError
from refseq.map.map import Map, check_names
from refseq.map.sequence import check_comparable
from refseq_bench.scenarios.errors import ScenarioError


def read_maps(
    paths: Sequence[Path], decisions: Sequence[Decision] = (), *, first_of_one_path: bool = False
) -> list[Map]:
    """Read maps that can be merged; all but the first have one path, unless that is asked of the first as well.

    Raises ``MapError`` for a file that is no such map or does not go with the first, ``ScenarioError`` for a file that
    is not there, before any is read, and for decisions about what is not there.
    """
    for path in paths:
        if not path.exists():
            raise ScenarioError(f"{path}: cannot be read: No such file or directory")
    if first_of_one_path or len({path.stem for path in paths[1:]}) < len(paths[1:]):
        check_names([path.stem for path in paths])
    first, *others = maps = [Map.load(path) for path in paths]
    for path, one in zip(paths, maps, strict=True):
        if not one.has_one_path and (first_of_one_path or one is not first):
            raise MapError(f"{path}: is a map of several paths; valid is a map of one")
    views = [(path.name, len(path)) for one in maps for path in one.paths]
    check_names([name for name, _ in views])
    _check_names_of(decisions, [name for name, _ in views])
    for path, other in zip(paths[1:], others, strict=True):
        try:
            check_comparable(first.sequences[0], other.sequence)
        except MapError as error:
            raise MapError(f"{path}: {error}") from error
    _check_views_of(decisions, dict(views))
    return maps


def _check_names_of(decisions: Sequence[Decision], known: Sequence[str]) -> None:
    for decision in decisions:
        for name in (decision.one, decision.other):
            if name not in known:
                raise ScenarioError(f"decisions: sequence {name!r} is unknown; valid are {', '.join(known)}")


def _check_views_of(decisions: Sequence[Decision], views: Mapping[str, int]) -> None:
    """Tell of decisions that nothing would ever be decided by; ``views`` are those of each path, in their order."""
    order = list(views)
    for decision in decisions:
        if decision.one == decision.other:
            raise ScenarioError(f"decisions: {decision.one!r} is one and other; valid are two sequences")
        if order.index(decision.one) > order.index(decision.other):
            raise ScenarioError(
                f"decisions: {decision.one!r} comes first in {decision.one!r} and {decision.other!r}; "
                f"valid is {decision.other!r}, which is merged before it"
            )
        for name, (first, last) in ((decision.one, decision.first), (decision.other, decision.second)):
            if last >= views[name]:
                raise ScenarioError(
                    f"decisions: {name!r} has no views {first} to {last}; valid are 0 to {views[name] - 1}"
                )
