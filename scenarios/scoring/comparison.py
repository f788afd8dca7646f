"""Comparisons: one drive localised in the map of another, as scorers and reports take it."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Stage
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.merging import Merging


@dataclass(frozen=True, slots=True)
class Drives:
    """Several reference drives, one behind the other: their names, and how many views each has."""

    names: tuple[str, ...]
    lengths: tuple[int, ...]

    @property
    def stretches(self) -> tuple[slice, ...]:
        """The views of each."""
        ends = list(itertools.accumulate(self.lengths))
        return tuple(slice(end - length, end) for end, length in zip(ends, self.lengths, strict=True))


@dataclass(frozen=True)
class Comparison:
    """A query drive of M views, localised in the map of a reference drive of K views.

    ``name`` says what changed between the two ("16:00 → 18:00"); comparisons of one name differ in the seed only and
    are pooled in tables. ``beliefs`` holds M answers for each method by its name: a ``Stage``, which is a word, or any
    other localiser's; the metadata say what was driven, and where.

    Where several drives were learnt, their views stand one behind the other, as ``drives`` tells (None: it is one), and
    places are views of any of them; ``mergings`` say, by method, which places were made one.
    """

    name: str
    reference_views: Sequence[View]
    reference_metadata: Mapping[str, object]
    query_views: Sequence[View]
    query_metadata: Mapping[str, object]
    beliefs: Mapping[str, Sequence[Belief]]
    drives: Drives | None = None
    mergings: Mapping[str, Merging] = field(default_factory=dict)

    @property
    def stretches(self) -> tuple[slice, ...]:
        """The reference views of each drive."""
        return self.drives.stretches if self.drives else (slice(0, len(self.reference_views)),)

    def named(self, place: int) -> str:
        """A place in words, by its number; where several drives were learnt, by that in its drive: "37 of path-b"."""
        if self.drives is None or len(self.drives.names) == 1:
            return str(place)
        within = zip(self.drives.names, self.drives.stretches, strict=True)
        name, stretch = next((name, stretch) for name, stretch in within if place < stretch.stop)
        return f"{place - stretch.start} of {name}"

    def held_by(self, method: str) -> NDArray[np.intp]:
        """For each reference view the one whose place it is at, (K,): itself, where nothing was merged."""
        found = self.mergings.get(method)
        return np.arange(len(self.reference_views)) if found is None else found.held_by

    def __post_init__(self) -> None:
        """Raise ``ScenarioError`` when the answers do not fit the views."""
        for method, beliefs in self.beliefs.items():
            self._check_method(method, beliefs)

    def _check_method(self, method: str, beliefs: Sequence[Belief]) -> None:
        kind = "stage" if method in set(Stage) else "method"
        where = f"comparison {self.name!r}, {kind} {str(method)!r}"
        if len(beliefs) != len(self.query_views):
            raise ScenarioError(f"{where}: {len(beliefs)} answers; valid is one a query view, {len(self.query_views)}")
        places = len(self.reference_views)
        for number, belief in enumerate(beliefs):
            if len(belief.places) != places or not 0 <= belief.best < places:
                raise ScenarioError(
                    f"{where}, view {number}: best place {belief.best} of {len(belief.places)}; "
                    f"valid is one of the map's {places} places"
                )


def method_label(method: str) -> str:
    """A method in words, for tables and legends."""
    return Stage(method).label if method in set(Stage) else method


def shared_methods(comparisons: Sequence[Comparison]) -> list[str]:
    """Methods that all comparisons have answers of: the thesis' stages in their order, then the others in theirs."""
    shared = [m for m in comparisons[0].beliefs if all(m in one.beliefs for one in comparisons)] if comparisons else []
    stages = [stage for stage in Stage if stage in shared]
    return [*stages, *(method for method in shared if method not in stages)]


HINDSIGHT = "hindsight"
"""Stands for a stage in the name of a method that answers when the drive is over."""


def single_view_of(method: str) -> str | None:
    """The method that answers each view for itself where this one uses their order; ``None`` for one that does not.

    A stage's is the stage ``uniform``, that of ``profile/stage`` and of ``profile/hindsight`` is ``profile/uniform``;
    baselines stand alone.
    """
    profile, stroke, stage = method.rpartition("/")
    if stage not in {*Stage, HINDSIGHT} or stage == Stage.UNIFORM:
        return None
    return f"{profile}{stroke}{Stage.UNIFORM}"
