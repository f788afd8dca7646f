"""Write what a search found: scenario files that can be run, and a table of all points."""

import csv
import io
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.schema import DriveTable
from refseq_bench.scenarios.campaign.search.dials import Point
from refseq_bench.scenarios.campaign.search.seek import Found
from refseq_bench.text_file import toml_lines

OWN = ("faults",)
"""Keys that a query does not take over from the reference."""


def scenario_text(case: Case, folder: Path, *, title: str, note: str, expect: str) -> str:
    """A case as a scenario file in ``folder``, which expects what the method misses, and makes no campaign fail."""
    scenario = case.scenario
    top = {
        "title": title,
        "note": note,
        "tags": ["search"],
        "blocking": False,
        "seeds": scenario.seeds,
        "expect": [expect],
    }
    reference, *further = (_plain(table, case.file, folder) for table in scenario.references)
    query = _plain(scenario.query, case.file, folder)
    lines = toml_lines(top).splitlines()
    lines += _table("[reference]", _changed(reference, _defaults(scenario.reference)))
    for table in further:
        lines += _table("[[further]]", _beside(table, reference, scenario.reference))
    lines += _table("[query]", _beside(query, reference, scenario.reference))
    for name in ("localise", "score", "limits"):
        lines += _table(f"[{name}]", getattr(scenario, name).model_dump(mode="json", exclude_defaults=True))
    return "\n".join(lines) + "\n"


def _plain(table: Any, file: Path, folder: Path) -> dict[str, Any]:
    """A drive as plain values; files that it names are named as seen from the new folder."""

    def moved(name: str) -> str:
        there = file.resolve().parent / name
        return os.path.relpath(there, folder.resolve()) if name.endswith(".toml") else name

    found: dict[str, Any] = table.model_dump(mode="json")
    found["world"] = moved(found["world"])
    found["cameras"] = {camera: moved(model) for camera, model in found["cameras"].items()}
    return found


def _defaults(table: Any) -> dict[str, Any]:
    return DriveTable(world=table.world).model_dump(mode="json")


def _changed(table: Mapping[str, Any], usual: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key == "world" or value != usual[key]}


def _beside(table: Mapping[str, Any], reference: Mapping[str, Any], declared: Any) -> dict[str, Any]:
    """The keys that a reader would not take over from the reference."""
    usual = {**reference, **{key: _defaults(declared)[key] for key in OWN}}
    return {key: value for key, value in table.items() if value != usual[key]}


def _table(heading: str, values: Mapping[str, Any]) -> list[str]:
    """A table, without what is None: TOML has no word for it, and it is the default."""
    told = {key: _without_none(value) for key, value in values.items() if value is not None}
    return ["", heading, *toml_lines(told).splitlines()] if told else []


def _without_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_none(one) for key, one in value.items() if one is not None}
    return [_without_none(one) for one in value] if isinstance(value, list) else value


def points_csv(found: Sequence[Found], names: Sequence[str]) -> str:
    """All points in the order of the search, as comma-separated values; a dial is empty where it is easy."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["success_percent", "success_narrow_percent", *names, "reason"])
    for one in found:
        shares = ["" if math.isnan(share) else f"{100 * share:.2f}" for share in (one.success, one.narrow)]
        writer.writerow([*shares, *(one.point.get(name, "") for name in names), one.reason])
    return text.getvalue()


def point_words(point: Point) -> str:
    """A point in words."""
    told = {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in point.items()}
    return ", ".join(f"{name} {value}" for name, value in told.items()) or "as in the file"
