"""A benchmark: several methods learn the same reference views and are asked about the same query views."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from refseq.logs import Recording
from refseq.view import View
from refseq_bench.scenarios.datasets.ground_truth import GroundTruth, PictureTruth, ground_truth
from refseq_bench.scenarios.datasets.layouts import dataset_pairs, is_dataset
from refseq_bench.scenarios.drives.inputs import WHOLE, DriveSelection, read_drive
from refseq_bench.scenarios.drives.left_out import check_all_views
from refseq_bench.scenarios.drives.naming import pair_name
from refseq_bench.scenarios.drives.selection import first_kept
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.by_name import answers_of_each
from refseq_bench.scenarios.methods.names import METHODS
from refseq_bench.scenarios.methods.plugins import MisbehavedError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import Figures, figures
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, Tolerance

ALL = "all drives together"


@dataclass(frozen=True, slots=True)
class DrivePair:
    """A reference drive and a query drive; ``truth`` judges by picture, None: by true poses."""

    reference: Path
    query: Path
    truth: GroundTruth | None = None


@dataclass(frozen=True, slots=True)
class Benchmark:
    """Methods to compare: ``pairs`` of drives, and the ``methods`` by name.

    ``places`` (``FROM:TO``) is the stretch of the reference drive that is learnt, so that the query drive is off the
    map before and behind it. ``start`` is where the query drive begins: a view's number, or a share of its views as
    ``40%``. ``kidnap`` (``FROM:TO``, numbers of the views left after ``start``) carries the robot from before view FROM
    to view TO, ahead or back. ``seed`` is that of the methods' own draws. All drives are read by ``selection``.
    """

    pairs: Sequence[DrivePair]
    methods: Sequence[str] = METHODS
    places: str | None = None
    start: str = "0"
    kidnap: str | None = None
    seed: int = 1
    selection: DriveSelection = WHOLE


def pairs_of(drives: Sequence[Path], truth: str | None = None, layout: str | None = None) -> tuple[DrivePair, ...]:
    """Drives two by two, or those of a data set's folder if that is alone; ``truth`` is a rule or a file, for all.

    Raises ``ScenarioError`` for an odd number of drives, and for a folder that is no data set's.
    """
    if len(drives) == 1 and (layout is not None or is_dataset(drives[0])):
        found = dataset_pairs(drives[0], layout)
        return tuple(DrivePair(one.reference, one.query, _truth(truth or one.truth)) for one in found)
    if layout is not None:
        raise ScenarioError(f"layout {layout!r} of {len(drives)} drives; valid is one folder, of a data set")
    if len(drives) % 2:
        raise ScenarioError(
            f"{drives[-1]}: comes without a query; valid are pairs of a reference and a query, or a data set's folder"
        )
    given = _truth(truth)
    return tuple(DrivePair(first, later, given) for first, later in zip(drives[::2], drives[1::2], strict=True))


def _truth(text: str | None) -> GroundTruth | None:
    return None if text is None else ground_truth(text)


def run_benchmark(
    benchmark: Benchmark, step: Callable[[str], object], failed: Callable[[str], object]
) -> list[Comparison]:
    """The answers of all methods to each pair of drives. ``step`` is told what begins.

    A user's localiser that fails in one is left out of all, and ``failed`` is told why; if nobody else was asked it
    raises ``MisbehavedError``. Raises ``ScenarioError`` for a file that is not there, before any is read, and for what
    does not fit the drives.
    """
    for path in (path for pair in benchmark.pairs for path in (pair.reference, pair.query)):
        if not path.exists():
            raise ScenarioError(f"{path}: is no file; valid is a recording")
    comparisons: list[Comparison] = []
    failures: dict[str, MisbehavedError] = {}
    for number, pair in enumerate(benchmark.pairs):
        step(f"pair {number + 1} of {len(benchmark.pairs)}")
        comparisons.append(_answered(pair, benchmark, failures))
    if failures and len(failures) == len(benchmark.methods):
        raise next(iter(failures.values()))
    for failure in failures.values():
        failed(str(failure))
    return [_without(one, failures) for one in comparisons] if failures else comparisons


def _without(comparison: Comparison, methods: Collection[str]) -> Comparison:
    left = {name: beliefs for name, beliefs in comparison.beliefs.items() if name not in methods}
    return replace(comparison, beliefs=left)


def _answered(pair: DrivePair, benchmark: Benchmark, failures: dict[str, MisbehavedError]) -> Comparison:
    """The answers to one pair of drives of all methods that have not failed; those that do now join ``failures``."""
    if pair.truth is not None and benchmark.selection.thin:
        raise ScenarioError("--thin leaves pictures out, and the ground truth counts all; valid is one of them")
    reference = read_drive(pair.reference, replace(benchmark.selection, views=benchmark.places))
    query = read_drive(pair.query, benchmark.selection)
    asked = Comparison("", reference.views, reference.metadata, query.views, query.metadata, {})
    if pair.truth is not None:
        check_all_views(reference.metadata, pair.reference)
        check_all_views(query.metadata, pair.query)
        asked = PictureTruth(pair.truth, (first_kept(benchmark.places), 0)).judging(asked)
    views = query_views(asked.query_views, benchmark, pair.query)
    left = [name for name in benchmark.methods if name not in failures]
    found = answers_of_each(left, reference.views, views, seed=benchmark.seed)
    failures.update(found.failures)
    return replace(asked, name=_name(reference, query, benchmark), query_views=views, beliefs=found.beliefs)


Tolerances = tuple[Tolerance, Tolerance]
"""The wide and the narrow one."""


def tolerances_of(benchmark: Benchmark, comparisons: Sequence[Comparison]) -> dict[str, Tolerances]:
    """The tolerances of each experiment by its name: those of the ground truth, or in metres."""
    pairs = zip(benchmark.pairs, comparisons, strict=True)
    return {one.name: pair.truth.tolerances if pair.truth else (WIDE, NARROW) for pair, one in pairs}


def by_experiment(
    comparisons: Sequence[Comparison], tolerances: Mapping[str, Tolerances] | None = None
) -> list[tuple[str, list[Figures]]]:
    """The figures of each name's comparisons, and, where names are several and tolerances equal, of all of them."""
    near = {one.name: (tolerances or {}).get(one.name, (WIDE, NARROW)) for one in comparisons}
    found = [(name, figures([one for one in comparisons if one.name == name], *both)) for name, both in near.items()]
    shared = set(near.values())
    return [*found, (ALL, figures(comparisons, *shared.pop()))] if len(near) > 1 and len(shared) == 1 else found


def query_views(views: Sequence[View], benchmark: Benchmark, path: Path) -> tuple[View, ...]:
    """The views of a query drive that are asked about."""
    left = tuple(views[first_view(benchmark.start, len(views), path) :])
    return kidnapped(left, benchmark.kidnap, path) if benchmark.kidnap else left


def first_view(start: str, count: int, path: Path) -> int:
    """Number of the first view that ``start`` means, of ``count``."""
    match = re.fullmatch(r"(\d+)(%?)", start)
    first = (int(match[1]) * count // 100 if match[2] else int(match[1])) if match else count
    if first >= count:
        raise ScenarioError(f"{path}: first view {start!r} is not in it; valid are 0 to {count - 1} and 0% to 99%")
    return first


def kidnapped(views: Sequence[View], kidnap: str, path: Path) -> tuple[View, ...]:
    """The views up to FROM, then those from TO on; what was carried in between is not in the odometry."""
    match = re.fullmatch(r"(\d+):(\d+)", kidnap)
    start, end = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 0 < start < len(views) or not 0 <= end < len(views):
        raise ScenarioError(
            f"{path}: kidnap {kidnap!r} is not in it; valid is FROM:TO, FROM from 1 and TO from 0 to {len(views) - 1}"
        )
    return (*views[:start], *views[end:])


def _name(reference: Recording, query: Recording, benchmark: Benchmark) -> str:
    """Name the experiment: what drives share that differ in the seed only, and what was made of them."""
    parts = [pair_name(reference.metadata, query.metadata)]
    if benchmark.places:
        parts.append(f"places {benchmark.places} learnt")
    if benchmark.start != "0":
        parts.append(f"from {benchmark.start if '%' in benchmark.start else f'view {benchmark.start}'} on")
    if benchmark.kidnap:
        parts.append(f"kidnapped {benchmark.kidnap}")
    return ", ".join(parts)
