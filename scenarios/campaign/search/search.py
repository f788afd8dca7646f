"""Worst-case search over a scenario's dials: the worst point, and the smallest change that fails."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from refseq.files import replace_text
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.results import slugs
from refseq_bench.scenarios.campaign.search.dials import Dial, Point, at_point
from refseq_bench.scenarios.campaign.search.found_files import point_words, points_csv, scenario_text
from refseq_bench.scenarios.campaign.search.seek import Found, seek
from refseq_bench.scenarios.campaign.search.shrink import shrunk
from refseq_bench.scenarios.errors import ScenarioError

Say = Callable[[str], None]
VALUE = attrgetter("value")


@dataclass(frozen=True)
class SearchResult:
    """All points that were run, the worst one, and the smallest change that fails; None: no point failed.

    The worst is that of the lowest ``Found.value``, met while shrinking or before. Where some failed it is among
    these: another may have a lower value, and pass.
    """

    points: tuple[Found, ...]
    worst: Found
    smallest: Found | None


def search(
    probe: Callable[[Point], Found], dials: Mapping[str, Dial], budget: int, *, seed: int, enough: float, say: Say
) -> SearchResult:
    """Seek the worst of ``budget`` points, and shrink it where its success is below ``enough``.

    Raises ``ScenarioError`` where the method fails at the file's own point, or nobody can drive there.
    """
    points: list[Found] = []

    def run(point: Point) -> Found:
        known = len(points)
        found = probe(point)
        points.append(found)
        say(f"{known}: {found_words(found)}")
        return found

    easy = run({})
    if not easy.success >= enough:
        raise ScenarioError(
            f"the scenario as it stands: {found_words(easy)}; valid is one with {100 * enough:g} % or more"
        )
    for _ in seek(run, dials, budget, seed):
        pass
    failing = _failing(points, enough)
    if not failing:
        there = [one for one in points if not math.isnan(one.value)]
        return SearchResult(tuple(points), min(there, key=VALUE), None)
    say("shrinking")
    smallest = shrunk(min(failing, key=VALUE).point, dials, lambda point: run(point).success < enough)
    # A point with fewer dials turned, met on the way, may be a worse one than the search had found.
    return SearchResult(tuple(points), min(_failing(points, enough), key=VALUE), probe(smallest))


def _failing(points: Sequence[Found], enough: float) -> list[Found]:
    return [one for one in points if one.success < enough]


def found_words(found: Found) -> str:
    """A point and what came of it, in words."""
    where = point_words(found.point)
    if math.isnan(found.success):
        return f"not run ({found.reason}): {where}"
    return f"{100 * found.success:.1f} %, narrow {100 * found.narrow:.1f} %: {where}"


def write_search(
    result: SearchResult, case: Case, dials: Mapping[str, Dial], folder: Path, *, told: str, enough: float
) -> list[Path]:
    """Write the table of points, and the worst and the smallest failure as scenario files; returns the files.

    ``told`` is how the search was asked for. Each file is replaced in one step.
    """
    folder.mkdir(parents=True, exist_ok=True)
    name = next(iter(slugs([f"{case.name} {case.scenario.judged}"]).values()))
    table = folder / f"{name}-points.csv"
    replace_text(table, points_csv(result.points, list(dials)))
    files = [table]
    for kind, found in (("worst", result.worst), ("smallest", result.smallest)):
        if result.smallest is None or found is None:
            continue
        path = folder / f"{name}-{kind}.toml"
        text = scenario_text(
            at_point(case, dials, found.point),
            folder,
            title=f"{case.name}, {kind} failure of {case.scenario.judged}: {point_words(found.point)}",
            note=f"Found by `{told}`: success {found_words(found)}",
            expect=f"success >= {100 * enough:g} %",
        )
        replace_text(path, text)
        files.append(path)
    return files
