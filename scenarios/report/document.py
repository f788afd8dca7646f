"""The report of a run: one HTML page that needs nothing beside it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from refseq.files import replace_text
from refseq.logs.notes import NOTES
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.recorded_config import recorded_config
from refseq_bench.scenarios.report.outline import outline_for
from refseq_bench.scenarios.report.page import rendered
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.report.sections.experiment import SectionSettings, section
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, Tolerance
from refseq_bench.scenarios.tables import NONE
from refseq_bench.sim.drives.operator import STYLES, OperatorStyle
from refseq_bench.sim.errors import SimError

LONG_VALUE = 80
"""Metadata longer than this many characters are folded away."""

FIRST_KEYS = ("world", "robot", "light", "seed", "truth", NOTES)


def write_report(
    path: Path,
    comparisons: Sequence[Comparison],
    *,
    title: str,
    outline: FloorOutline | None = None,
    tolerances: Mapping[str, tuple[Tolerance, Tolerance]] | None = None,
) -> None:
    """Write the report of some comparisons to ``path``, replacing it in one step.

    Comparisons of the same name are seeds of one experiment: they are pooled in the tables, and the first of them that
    has true poses is drawn. ``outline`` are the walls that all queries were driven between, as polylines of (m, 2)
    points [m]; None: those that the recording of the drawn query tells. ``tolerances`` are the wide and the narrow one
    of an experiment by its name, by default 1.5 and 0.5 m. Raises ``ScenarioError`` without any comparison.
    """
    if not comparisons:
        raise ScenarioError("a report of 0 comparisons; valid is at least one")
    names = dict.fromkeys(comparison.name for comparison in comparisons)
    runs = {name: [one for one in comparisons if one.name == name] for name in names}
    near = {name: (tolerances or {}).get(name, (WIDE, NARROW)) for name in names}
    walls = {name: outline_for(same) if outline is None else outline for name, same in runs.items()}
    settings = {name: SectionSettings(*both, outline=walls[name]) for name, both in near.items()}
    page = rendered(
        "report.html.j2",
        title=title,
        facts=facts(comparisons),
        details=details(comparisons),
        sections=[section(name, same, settings[name]) for name, same in runs.items()],
    )
    replace_text(path, page)


def facts(comparisons: Sequence[Comparison]) -> list[tuple[str, str, str]]:
    """Short metadata as (key, values of the reference drives, values of the query drives)."""
    sides = _sides(comparisons)
    keys = sorted({key for side in sides.values() for key in side}, key=_key_order)
    reference, query = ({key: ", ".join(side.get(key, (NONE,))) for key in keys} for side in sides.values())
    return [(key, reference[key], query[key]) for key in keys if not _is_long(key, sides)]


def details(comparisons: Sequence[Comparison]) -> list[tuple[str, str]]:
    """Long metadata, such as the resolved configuration, as (which, text); of both sides where one side's is long."""
    sides = _sides(comparisons)
    return sorted(
        (f"{name}: {key}", "\n".join(values))
        for name, side in sides.items()
        for key, values in side.items()
        if _is_long(key, sides)
    )


Sides = Mapping[str, Mapping[str, tuple[str, ...]]]
"""Values of each key, of the reference drives and of the query drives."""


def _sides(comparisons: Sequence[Comparison]) -> Sides:
    return {
        "reference": _values(comparison.reference_metadata for comparison in comparisons),
        "query": _values(comparison.query_metadata for comparison in comparisons),
    }


def _is_long(key: str, sides: Sides) -> bool:
    """A table's row would be too high; notes are to be read, however long."""
    return key != NOTES and max(len(", ".join(side.get(key, ()))) for side in sides.values()) > LONG_VALUE


def _values(drives: Iterable[Mapping[str, object]]) -> dict[str, tuple[str, ...]]:
    """All distinct values of each key, nested ones under ``outer.inner``."""
    seen: dict[str, dict[str, None]] = {}
    for metadata in drives:
        for key, value in (*_flat(metadata), *_operator(metadata)):
            seen.setdefault(key, {})[str(value)] = None
    return {key: tuple(values) for key, values in seen.items()}


def _flat(metadata: Mapping[str, object], prefix: str = "") -> Iterable[tuple[str, object]]:
    for key, value in metadata.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _operator(metadata: Mapping[str, object]) -> Iterable[tuple[str, str]]:
    """Row of the person who led, where that was no careful one on the route's own lane."""
    told = recorded_config(metadata).get("operator")
    try:
        style = OperatorStyle(**told) if isinstance(told, dict) else OperatorStyle()
    except (TypeError, SimError):
        return  # of another version, or somebody else's
    own_lane = replace(style, strength=1.0, side=0.0)
    words = [
        "" if own_lane == OperatorStyle() else next((name for name, one in STYLES.items() if one == own_lane), "own"),
        f"strength {style.strength:g}" if style.strength != 1 else "",
        f"{abs(style.side):g} m to the {'left' if style.side > 0 else 'right'}" if style.side else "",
    ]
    if any(words):
        yield "operator", ", ".join(filter(None, words))


def _key_order(key: str) -> tuple[int, str]:
    """Put what was driven first, then the rest by name."""
    return (FIRST_KEYS.index(key) if key in FIRST_KEYS else len(FIRST_KEYS)), key
