"""All that can find a place, by name: the thesis' stages with any profile, and the baselines."""

from collections.abc import Iterable, Mapping, Sequence

from refseq.belief import Belief, Localiser, Stage
from refseq.localiser import localise
from refseq.profile import PROFILES, profile_named
from refseq.sequence import learn
from refseq.view import View
from scenarios.baselines import BASELINES, Reference
from scenarios.errors import ScenarioError

STAGED = tuple(f"{profile}/{stage}" for profile in PROFILES for stage in Stage)
"""Our own localiser's names: a profile and a stage, with a stroke between."""

METHODS = (*STAGED, *BASELINES)


def methods_named(names: Sequence[str] | None) -> tuple[str, ...]:
    """Methods by their names, each once; without names all there are. ``ScenarioError`` for an unknown one."""
    for name in names or ():
        if name not in METHODS:
            raise ScenarioError(f"method {name!r} is unknown; valid are {', '.join(METHODS)}")
    return tuple(dict.fromkeys(names or METHODS))


def answers(
    methods: Sequence[str], reference: Sequence[View], query: Sequence[View], *, seed: int = 0
) -> dict[str, list[Belief]]:
    """What each method, having learnt the reference views, answers to the query views."""
    drive = Reference(reference)
    found = run({name: BASELINES[name](drive) for name in methods if name in BASELINES}, query)
    for profile in dict.fromkeys(name.split("/")[0] for name in methods if name in STAGED):
        stages = [stage for stage in Stage if f"{profile}/{stage}" in methods]
        sequence = learn(reference, profile=profile_named(profile))
        beliefs = localise(sequence, query, stages=stages, seed=seed)
        found |= {f"{profile}/{stage}": beliefs[stage] for stage in stages}
    return {name: found[name] for name in methods}


def run(localisers: Mapping[str, Localiser], views: Iterable[View]) -> dict[str, list[Belief]]:
    """Ask several localisers about the same views, one view after the other, so that they can share what it costs."""
    found: dict[str, list[Belief]] = {name: [] for name in localisers}
    for localiser in localisers.values():
        localiser.reset()
    for view in views:
        for name, localiser in localisers.items():
            found[name].append(localiser.update(view))
    return found
