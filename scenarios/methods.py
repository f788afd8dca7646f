"""All that can find a place, by name: the thesis' stages with any profile, and the baselines."""

from collections.abc import Iterable, Mapping, Sequence

from refseq.belief import Belief, Localiser, Stage
from refseq.localiser import localise, smoothed
from refseq.profile import PROFILES
from refseq.view import View
from scenarios.baselines import BASELINES, Reference, Shelf, learnt_anew
from scenarios.errors import ScenarioError
from scenarios.own import OwnLocaliser, check_own, installed, is_own

STAGED = tuple(f"{profile}/{stage}" for profile in PROFILES for stage in Stage)
"""Our own localiser's names: a profile and a stage, with a stroke between."""

METHODS = (*STAGED, *BASELINES)

HINDSIGHT = tuple(f"{profile}/hindsight" for profile in PROFILES)
"""The chain's answers in the light of the whole drive. No robot could have known them on its way: they are in no group,
and are asked for and scored by this name only."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    **{profile: tuple(f"{profile}/{stage}" for stage in Stage) for profile in PROFILES},
    "baselines": tuple(BASELINES),
}
"""Names that stand for several methods: a profile for its stages, and all baselines."""


FAMILIES: Mapping[str, tuple[str, ...]] = {
    **{profile: GROUPS[profile] for profile in PROFILES},
    "words": ("fabmap-naive", "fabmap"),
    "vlad": ("vlad", "topological", "topometric", "sequence-graph"),
}
"""Methods that are asked together, as they share what is dear."""


def written_out(names: Iterable[str]) -> tuple[str, ...]:
    """Methods by name, each once, with groups written out; names that are not known are left as they are."""
    return tuple(dict.fromkeys(name for one in names for name in GROUPS.get(one, (one,))))


def methods_named(names: Sequence[str] | None) -> tuple[str, ...]:
    """Methods by their names, each once; without names all there are. ``ScenarioError`` for an unknown one."""
    wanted = written_out(names or METHODS)
    check_methods(wanted)
    return wanted


def check_methods(names: Iterable[str]) -> None:
    """Raise ``ScenarioError`` for the first name that is no method's."""
    for name in names:
        if is_own(name):
            check_own(name)
        elif name not in (*METHODS, *HINDSIGHT):
            valid = ", ".join((*METHODS, *GROUPS, *HINDSIGHT, *installed()))
            raise ScenarioError(f"method {name!r} is unknown; valid are {valid}, package.module:Class")


def family(name: str) -> str:
    """What a method shares its dear steps with: a profile's stages, the methods on VLAD; else it is its own."""
    return next((shared for shared, members in FAMILIES.items() if name in members), name)


def answers(
    methods: Sequence[str], reference: Sequence[View], query: Sequence[View], *, seed: int = 0
) -> dict[str, list[Belief]]:
    """What each method, having learnt the reference views, answers to the query views."""
    return Learnt(methods, reference, seed=seed).answers(query)


class Learnt:
    """Several methods that have learnt the same reference views.

    ``sequences`` are the maps of our own localiser by profile, from the ``shelf``, ``localisers`` all other methods by
    name. Raises ``MisbehavedError`` where a user's localiser fails.
    """

    def __init__(
        self, methods: Sequence[str], reference: Sequence[View], *, seed: int = 0, shelf: Shelf = learnt_anew
    ) -> None:
        self._methods, self._seed = methods, seed
        drive = Reference(reference, shelf)
        ours = [name for name in methods if name in (*STAGED, *HINDSIGHT)]
        profiles = dict.fromkeys(name.split("/")[0] for name in ours)
        self.sequences = {profile: drive.sequence(profile) for profile in profiles}
        self.localisers: dict[str, Localiser] = {
            name: OwnLocaliser(name, reference) if is_own(name) else BASELINES[name](drive)
            for name in methods
            if name not in ours
        }

    def answers(self, query: Sequence[View]) -> dict[str, list[Belief]]:
        """What each method answers to the query views."""
        found = run(self.localisers, query)
        for profile, sequence in self.sequences.items():
            stages = [stage for stage in Stage if f"{profile}/{stage}" in self._methods]
            beliefs = localise(sequence, query, stages=stages, seed=self._seed)
            found |= {f"{profile}/{stage}": beliefs[stage] for stage in stages}
            if (hindsight := f"{profile}/hindsight") in self._methods:
                found[hindsight] = smoothed(sequence, query, seed=self._seed)
        return {name: found[name] for name in self._methods}


def run(localisers: Mapping[str, Localiser], views: Iterable[View]) -> dict[str, list[Belief]]:
    """Ask several localisers about the same views, one view after the other, so that they can share what it costs."""
    found: dict[str, list[Belief]] = {name: [] for name in localisers}
    for localiser in localisers.values():
        localiser.reset()
    for view in views:
        for name, localiser in localisers.items():
            found[name].append(localiser.update(view))
    return found
