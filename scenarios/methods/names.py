"""Names of all that can find a place: the thesis' stages with any profile, and the baselines.

Whoever declares methods or reads what they answered loads none of them; ``refseq_bench.scenarios.methods.by_name``
learns and asks them.
"""

from collections.abc import Collection, Iterable, Mapping

from refseq.belief import Stage
from refseq.map.names import ASKING_NETWORK, PROFILE_NAMES
from refseq.view import LASER
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.scoring.comparison import HINDSIGHT

STAGED = tuple(f"{profile}/{stage}" for profile in PROFILE_NAMES for stage in Stage)
"""Our own localiser's names: a profile and a stage, with a stroke between."""

METHODS = (*(name for name in STAGED if not name.startswith(ASKING_NETWORK)), *BASELINES)
"""All methods but the stages of profiles that ask a neural network: these are asked where they are named."""

IN_HINDSIGHT = tuple(f"{profile}/{HINDSIGHT}" for profile in PROFILE_NAMES)
"""The chain's answers in the light of the whole drive. No robot could have known them on its way: they are in no group,
and are asked for and scored by this name only."""

BASELINE_GROUP = "baselines"
GROUPS: Mapping[str, tuple[str, ...]] = {
    **{profile: tuple(f"{profile}/{stage}" for stage in Stage) for profile in PROFILE_NAMES},
    BASELINE_GROUP: tuple(BASELINES),
}
"""Names that stand for several methods: a profile for its stages, and all baselines."""

OF_LASERS = ("hamming",)
"""Baselines that answer where a laser alone is looked at: by features of ours. All others describe pictures."""

FAMILIES: Mapping[str, tuple[str, ...]] = {
    "words": ("fabmap-naive", "fabmap"),
    "vlad": ("vlad", "topological", "topometric", "sequence-graph"),
}
"""Methods that are asked together, as they share what is dear."""


def profile_of(method: str) -> str | None:
    """The profile in the name of a stage of ours, or of its hindsight, with its settings: ``thesis+chain.window=20``.

    None: the method is another. The settings are not looked at.
    """
    profile, _, stage = method.rpartition("/")
    ours = profile.partition("+")[0] in PROFILE_NAMES and (stage in tuple(Stage) or stage == HINDSIGHT)
    return profile if ours else None


def is_staged(method: str) -> bool:
    """True for a stage of our own localiser, with any profile; hindsight is none."""
    return profile_of(method) is not None and not is_hindsight(method)


def is_hindsight(method: str) -> bool:
    """True for the answers of a chain of ours in the light of the whole drive."""
    return profile_of(method) is not None and method.endswith(f"/{HINDSIGHT}")


def modules_of(names: Iterable[str]) -> tuple[str, ...]:
    """Modules of the baselines among some methods, which are imported by their names only."""
    return tuple(sorted({BASELINES[name].module for name in names if name in BASELINES}))


def written_out(names: Iterable[str], sensors: Collection[str] | None = None) -> tuple[str, ...]:
    """Methods by name, each once, with groups written out; names that are not known are left as they are.

    Where the laser is all that is looked at, the group of baselines stands for those that can answer to it.
    """
    laser_alone = sensors is not None and set(sensors) == {LASER}
    return tuple(dict.fromkeys(name for one in names for name in _members(one, laser_alone)))


def _members(name: str, laser_alone: bool) -> tuple[str, ...]:
    profile, plus, _ = name.partition("+")
    if plus and profile in PROFILE_NAMES and "/" not in name:
        return tuple(f"{name}/{stage}" for stage in Stage)
    return OF_LASERS if laser_alone and name == BASELINE_GROUP else GROUPS.get(name, (name,))


def family(name: str) -> str:
    """Name the family that a method shares its dear steps with: a profile's stages, those on VLAD; else itself."""
    if is_staged(name):
        return name.rpartition("/")[0]
    return next((shared for shared, members in FAMILIES.items() if name in members), name)
