"""The floor plan that a drive was in, by the metadata of its recording.

A world's name tells no plan: one's own may have the name of a world of the library.
"""

from collections.abc import Mapping
from pathlib import Path

from refseq_bench.scenarios.recorded_config import recorded_config
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.rules import checked
from refseq_bench.worlds.plans.schema import FloorPlan

CHANGING = {"door", "poster", "cabinet", "bin", "furniture", "car", "person"}
"""Tables of a plan of which something may be otherwise on another day."""


def driven_plan(metadata: Mapping[str, object]) -> FloorPlan | None:
    """The plan as it was on the drive's day; of a recording that holds none, the bench's of that name. None: unknown.

    The first drive's, where the metadata are those of several.
    """
    return _recorded(metadata) or _named(metadata)


def known_by_name(metadata: Mapping[str, object]) -> bool:
    """Tell whether the bench's world of the name in a drive's metadata is the one that it was in.

    Of a recording that holds no plan, the name alone counts. Routes do not: a drive may have brought its own.
    """
    named, recorded = _named(metadata), _recorded(metadata)
    if named is None or recorded is None:
        return named is not None
    apart = {"routes", *(() if metadata.get("change", "none") == "none" else CHANGING)}
    return named.model_dump(exclude=apart) == recorded.model_dump(exclude=apart)


def _recorded(metadata: Mapping[str, object]) -> FloorPlan | None:
    """The plan that a recording holds, where it is there and of the name that is told."""
    try:
        plan = checked(FloorPlan.model_validate(recorded_config(metadata).get("plan")), "the recording's plan")
    except (ValueError, TypeError, RecursionError, WorldsError):
        return None
    return plan if plan.name == metadata.get("world") else None


def _named(metadata: Mapping[str, object]) -> FloorPlan | None:
    """The bench's world of that name: never a file, whatever a recording calls its world."""
    name = str(metadata.get("world", ""))
    try:
        return None if Path(name).suffix == ".toml" else load_plan(name)
    except WorldsError:
        return None
