"""All that can find a place, learnt and asked by name: the thesis' stages with any profile, and the baselines."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

from refseq.belief import Belief, LocaliserProtocol, Stage
from refseq.errors import RefseqError
from refseq.features.memory import DescriptionMemory, described_once
from refseq.map.localiser import localise, smoothed
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.names import profile_of
from refseq_bench.scenarios.methods.plugins import MisbehavedError, PluginLocaliser, is_plugin
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.comparison import HINDSIGHT
from refseq_bench.scenarios.scoring.merging import Merging, by_views, merged_drives


def answers(
    methods: Sequence[str], reference: Sequence[View], query: Sequence[View], *, seed: int = 0
) -> dict[str, list[Belief]]:
    """Answers of each method to the query views after it has learnt the reference views."""
    drives = {"reference": Reference(reference)}
    with described_once(DescriptionMemory()), Learnt(methods, drives, seed=seed) as learnt:
        return learnt.answers(query)


@dataclass(frozen=True)
class EachAnswered:
    """Answers by method, and by users' localisers that have none the reason."""

    beliefs: Mapping[str, list[Belief]]
    failures: Mapping[str, MisbehavedError]


def answers_of_each(
    methods: Sequence[str], reference: Sequence[View], query: Sequence[View], *, seed: int = 0
) -> EachAnswered:
    """Answers of each method as ``answers`` gives them; a user's localiser that fails leaves the others alone."""
    beliefs = answers([name for name in methods if not is_plugin(name)], reference, query, seed=seed)
    failures = {}
    for name in filter(is_plugin, methods):
        try:
            beliefs |= answers([name], reference, query, seed=seed)
        except MisbehavedError as error:
            failures[name] = error
    return EachAnswered({name: beliefs[name] for name in methods if name in beliefs}, failures)


class InMap:
    """Our own localiser with a profile, in a map of all drives; ``maps`` are theirs as they were learnt.

    ``merging`` tells how those of several became one, None where there is one.
    """

    def __init__(self, profile: str, drives: Mapping[str, Reference], *, merging: bool) -> None:
        self.maps = tuple(drive.map(profile).named(name) for name, drive in drives.items())
        self.map = self.maps[0]
        self.merging: Merging | None = None
        if len(self.maps) > 1:
            self.map, self.merging = merged_drives(self.maps, merging)

    def answers(self, query: Sequence[View], stages: Sequence[Stage], seed: int) -> Mapping[Stage, list[Belief]]:
        """Answers of each stage to the query views, by the views that were learnt."""
        found = localise(self.map, query, stages=stages, seed=seed)
        return {stage: [by_views(self.map, belief) for belief in beliefs] for stage, beliefs in found.items()}

    def in_hindsight(self, query: Sequence[View], seed: int) -> list[Belief]:
        """Answers of the chain in the light of the whole drive."""
        return smoothed(self.map, query, seed=seed)


def _baseline(name: str, drive: Reference) -> LocaliserProtocol:
    """A baseline that has learnt a drive. Raises ``ScenarioError`` with its name where the drive does not fit it."""
    try:
        return BASELINES[name](drive)
    except RefseqError as error:
        raise ScenarioError(f"{name}: {error}") from error


class Learnt:
    """Several methods that have learnt the same ``drives``, each by its name.

    Our own localiser has one map of all, of several drives with ``merging`` after what they share was taken out. All
    others have several drives one behind the other, as one on which the robot was carried from each end to the next
    start. Answers are about the views of all drives, one behind the other. ``ours`` are by profile, ``localisers`` all
    others by name; users' own have a process each until the ``with`` block ends. Raises ``MisbehavedError`` where one
    of those fails.
    """

    def __init__(
        self, methods: Sequence[str], drives: Mapping[str, Reference], *, seed: int = 0, merging: bool = True
    ) -> None:
        self._methods, self._seed = methods, seed
        first, *further = drives.values()
        drive = first if not further else Reference([view for one in drives.values() for view in one.views])
        profiles = dict.fromkeys(profile for name in methods if (profile := profile_of(name)))
        self.ours = {profile: InMap(profile, drives, merging=merging) for profile in profiles}
        self.localisers: dict[str, LocaliserProtocol] = {
            name: PluginLocaliser(name, drive.views) if is_plugin(name) else _baseline(name, drive)
            for name in methods
            if profile_of(name) is None
        }

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        for guest in self.guests:
            guest.close()

    @property
    def guests(self) -> list[PluginLocaliser]:
        """The users' own."""
        return [one for one in self.localisers.values() if isinstance(one, PluginLocaliser)]

    @property
    def mergings(self) -> dict[str, Merging]:
        """Mergings of the drives, by the methods that have an atlas of them."""
        merged = {profile: one.merging for profile, one in self.ours.items() if one.merging is not None}
        return {f"{profile}/{stage}": one for profile, one in merged.items() for stage in self._stages(profile)}

    def answers(self, query: Sequence[View]) -> dict[str, list[Belief]]:
        """Answers of each method to the query views."""
        found = run(self.localisers, query)
        for profile, one in self.ours.items():
            beliefs = one.answers(query, self._stages(profile), self._seed)
            found |= {f"{profile}/{stage}": answers for stage, answers in beliefs.items()}
            if (hindsight := f"{profile}/{HINDSIGHT}") in self._methods and one.map.has_one_path:
                found[hindsight] = one.in_hindsight(query, self._seed)
        return {name: found[name] for name in self._methods}

    def _stages(self, profile: str) -> list[Stage]:
        return [stage for stage in Stage if f"{profile}/{stage}" in self._methods]


def run(localisers: Mapping[str, LocaliserProtocol], views: Iterable[View]) -> dict[str, list[Belief]]:
    """Ask several localisers about the same views, one view after the other, so that they can share what it costs."""
    found: dict[str, list[Belief]] = {name: [] for name in localisers}
    for localiser in localisers.values():
        localiser.reset()
    for view in views:
        for name, localiser in localisers.items():
            found[name].append(localiser.update(view))
    return found
