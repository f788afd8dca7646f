"""Change a plan between two drives by strengths: people, doors, bins and chairs, posters, cars.

Each kind of change has a strength from 0 to 1: the share of things of that kind that are touched, on average. Every
thing draws its own number once for a seed and is touched where the strength is above it, so more strength touches
the same things in the same way and further ones. One kind's strength redraws no other kind; but what one thing takes
up is in the next one's way, so with more furniture moved a bin may end up elsewhere.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from types import MappingProxyType

from refseq_bench.worlds.change.changes import ASTRAY, NUDGED, change_doors, change_posters, move, repark_cars
from refseq_bench.worlds.change.pedestrians import add_standing, add_walkers
from refseq_bench.worlds.errors import ChangeError
from refseq_bench.worlds.options import once
from refseq_bench.worlds.plans.rules import checked
from refseq_bench.worlds.plans.schema import FloorPlan


@dataclass(frozen=True, slots=True)
class Change:
    """Strengths of change, each 0..1; raises ``ChangeError`` for other values.

    ``people`` stand beside the routes, one in 8 m at strength 1; ``walkers`` walk to and fro, one in 16 m. ``doors``
    open, shut or take another angle. ``bins``, chairs and boxes stand elsewhere; tables, cupboards, shelves and
    cabinets (``furniture``) are moved a little. ``posters`` are gone, replaced, or a new one joins them. ``cars`` are
    gone or stand in another's bay.
    """

    people: float = 0.0
    walkers: float = 0.0
    doors: float = 0.0
    bins: float = 0.0
    furniture: float = 0.0
    posters: float = 0.0
    cars: float = 0.0

    def __post_init__(self) -> None:
        for kind in KINDS:
            if not 0.0 <= getattr(self, kind) <= 1.0:
                raise ChangeError(f"change: {kind} = {getattr(self, kind)} is not valid; it should be from 0 to 1")

    def as_text(self) -> str:
        """Return the text that ``change_named`` reads as this change."""
        strengths = {kind: getattr(self, kind) for kind in KINDS}
        return ",".join(f"{kind}={strength}" for kind, strength in strengths.items() if strength) or "none"


KINDS = tuple(field.name for field in fields(Change))
PRESETS = MappingProxyType(
    {
        "none": "",
        "few": "people=0.15,walkers=0.1,doors=0.1,bins=0.2,furniture=0.05,posters=0.05,cars=0.3",
        "busy": "people=0.6,walkers=0.6,doors=0.4,bins=0.5,furniture=0.2,posters=0.2,cars=0.8",
    }
)
"""Changes with a name of their own, and what they stand for."""
FORM = "any of " + ", ".join(f"{kind}=0..1" for kind in KINDS) + ", commas between"


def change_named(text: str) -> Change:
    """Read a change: a preset's name, ``people=0.5,doors=0.3``, or a preset with strengths after it that replace its.

    Raises ``ChangeError`` with the value and what is valid.
    """
    start, _, rest = text.partition(",")
    preset, parts = (PRESETS[start].split(","), rest.split(",")) if start in PRESETS else ([], text.split(","))
    given, said = ([_strength(text, part) for part in some if part or start not in PRESETS] for some in (preset, parts))
    return Change(**dict(given) | once(said, f"change '{text}'", ChangeError))


def _strength(text: str, part: str) -> tuple[str, float]:
    kind, _, value = part.partition("=")
    if kind not in KINDS:
        raise ChangeError(f"change '{text}': unknown '{part}'; valid is {', '.join(PRESETS)}, or {FORM}")
    try:
        return kind, float(value)
    except ValueError:
        raise ChangeError(f"change '{text}': {kind} '{value}' is not valid; it should be from 0 to 1") from None


def changed(plan: FloorPlan, change: Change, seed: int) -> FloorPlan:
    """Return the plan as it is on another day; the same seed gives the same, and no strength at all the plan itself.

    What results is checked as every plan is, and nothing that has changed stands in the way of a robot on a route.
    Raises ``ChangeError`` for a seed below 0.
    """
    if seed < 0:
        raise ChangeError(f"change: seed = {seed} is not valid; it should be 0 or more")
    if change == Change():
        return plan
    for kind, alter in _CHANGES.items():
        plan = alter(plan, getattr(change, kind), seed)
    return checked(plan, f"{plan.name}, changed as {change.as_text()} by seed {seed}")


_CHANGES: Mapping[str, Callable[[FloorPlan, float, int], FloorPlan]] = MappingProxyType(
    {
        "doors": change_doors,
        "furniture": partial(move, NUDGED),
        "bins": partial(move, ASTRAY),
        "posters": change_posters,
        "cars": repark_cars,
        "people": add_standing,
        "walkers": add_walkers,
    }
)
"""Plan, strength and seed to the changed plan, in the order in which they are made: people come last."""
