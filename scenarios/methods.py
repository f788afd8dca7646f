"""All that can find a place, by name: the thesis' stages with any profile, and the baselines."""

from collections.abc import Iterable, Mapping, Sequence

from refseq.atlas_localiser import localise_in
from refseq.belief import Belief, Localiser, Stage
from refseq.localiser import localise, smoothed
from refseq.profile import PROFILES
from refseq.view import View
from scenarios.baselines import BASELINES, Reference
from scenarios.errors import ScenarioError
from scenarios.merging import Merging, by_views, merged_drives
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
    return Learnt(methods, Reference(reference), seed=seed).answers(query)


class Learnt:
    """Several methods that have learnt the same reference drive.

    ``sequences`` are what our own localiser keeps, ``maps`` what it has learnt, ``localisers`` all other methods by
    name; ``mergings`` tell how several drives were merged, by method. Raises ``MisbehavedError`` where a user's
    localiser fails.
    """

    def __init__(self, methods: Sequence[str], drive: Reference, *, seed: int = 0) -> None:
        self._methods, self._seed = methods, seed
        self.sequences = {profile: drive.sequence(profile) for profile in self._profiles()}
        self.maps = list(self.sequences.values())
        self.mergings: Mapping[str, Merging] = {}
        self.localisers = self._others(drive)

    def answers(self, query: Sequence[View]) -> dict[str, list[Belief]]:
        """What each method answers to the query views."""
        found = run(self.localisers, query) | self._ours(query)
        return {name: found[name] for name in self._methods}

    def _profiles(self) -> list[str]:
        return list(dict.fromkeys(name.split("/")[0] for name in self._methods if name in (*STAGED, *HINDSIGHT)))

    def _stages(self, profile: str) -> list[Stage]:
        return [stage for stage in Stage if f"{profile}/{stage}" in self._methods]

    def _others(self, drive: Reference) -> dict[str, Localiser]:
        return {
            name: OwnLocaliser(name, drive.views) if is_own(name) else BASELINES[name](drive)
            for name in self._methods
            if name not in (*STAGED, *HINDSIGHT)
        }

    def _ours(self, query: Sequence[View]) -> dict[str, list[Belief]]:
        found: dict[str, list[Belief]] = {}
        for profile, sequence in self.sequences.items():
            beliefs = localise(sequence, query, stages=self._stages(profile), seed=self._seed)
            found |= {f"{profile}/{stage}": answers for stage, answers in beliefs.items()}
            if (hindsight := f"{profile}/hindsight") in self._methods:
                found[hindsight] = smoothed(sequence, query, seed=self._seed)
        return found


class LearntTogether(Learnt):
    """Several methods that have learnt the same ``drives``, each by its name.

    Our own localiser has an atlas of them, with ``merging`` after what they share was taken out. All others have them
    one behind the other, as one drive on which the robot was carried from each end to the next start. Answers are about
    the views of all drives, one behind the other.
    """

    def __init__(
        self, methods: Sequence[str], drives: Mapping[str, Reference], *, seed: int = 0, merging: bool = True
    ) -> None:
        self._methods, self._seed = methods, seed
        learnt = {profile: [drive.sequence(profile) for drive in drives.values()] for profile in self._profiles()}
        merged = {profile: merged_drives(list(drives), maps, merging) for profile, maps in learnt.items()}
        self._atlases = {profile: atlas for profile, (atlas, _) in merged.items()}
        self.sequences = {
            f"{profile}/{name}": sequence
            for profile, atlas in self._atlases.items()
            for name, sequence in zip(atlas.names, atlas.sequences, strict=True)
        }
        self.maps = [one for maps in learnt.values() for one in maps]
        self.mergings = {
            f"{profile}/{stage}": found for profile, (_, found) in merged.items() for stage in self._stages(profile)
        }
        self.localisers = self._others(Reference([view for drive in drives.values() for view in drive.views]))

    def _ours(self, query: Sequence[View]) -> dict[str, list[Belief]]:
        found: dict[str, list[Belief]] = {}
        for profile, atlas in self._atlases.items():
            beliefs = localise_in(atlas, query, stages=self._stages(profile), seed=self._seed)
            found |= {f"{profile}/{s}": [by_views(atlas, one) for one in answers] for s, answers in beliefs.items()}
        return found


def run(localisers: Mapping[str, Localiser], views: Iterable[View]) -> dict[str, list[Belief]]:
    """Ask several localisers about the same views, one view after the other, so that they can share what it costs."""
    found: dict[str, list[Belief]] = {name: [] for name in localisers}
    for localiser in localisers.values():
        localiser.reset()
    for view in views:
        for name, localiser in localisers.items():
            found[name].append(localiser.update(view))
    return found
