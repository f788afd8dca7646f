"""The ablation of sensors and context (card B9, Fig. 2.13): what each sensor and each stage contributes.

A map is learnt of each reference drive once, with all sensors; each query view's features are found once. Every row of
the table asks the map with some of the sensors' blocks, which are independent of each other.
"""

import csv
import io
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from refseq.belief import Stage
from refseq.features import Extractor, Observed
from refseq.files import replace_text
from refseq.inference.matching.information import Information, posterior_information, proven_information
from refseq.logs import Recording
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence, learn
from refseq.view import LASER, View
from scenarios.drives.evaluate import StageResult, compare, results
from scenarios.drives.inputs import read_drive
from scenarios.drives.naming import pair_name
from scenarios.errors import ScenarioError
from scenarios.scoring.comparison import Comparison
from scenarios.scoring.score import WIDE, path_of

FIGURE = (("camera-1",), ("camera-1", LASER), ("camera-2", LASER), ("camera-1", "camera-2"))
"""The sensors that Fig. 2.11 and 2.13 leave alone with the mixture, before all of them."""

TABLES = (".csv", ".json")
"""Formats that the table can be written in, by the file's ending."""


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table: the ``sensors`` that are asked, by what name, and with how much context."""

    name: str
    sensors: tuple[str, ...]
    stage: Stage


def cases_of(sensors: Sequence[str], *, every: bool = False) -> tuple[Case, ...]:
    """The rows of Fig. 2.13 as far as the ``sensors`` allow; with ``every`` each subset of them at each stage.

    In the figure the subsets are asked by single views, and only all sensors together with more context.
    """
    all_of = tuple(sorted(sensors))
    if every:
        sizes = range(1, len(all_of))
        subsets = [subset for size in sizes for subset in itertools.combinations(all_of, size)]
    else:
        subsets = [subset for subset in FIGURE if set(subset) < set(all_of)]
    alone = [Case(" + ".join(subset), subset, stage) for subset in subsets for stage in _stages(every)]
    name = "all" if len(all_of) > 1 else all_of[0]
    return (*alone, *(Case(name, all_of, stage) for stage in Stage))


def _stages(every: bool) -> tuple[Stage, ...]:
    return tuple(Stage) if every else (Stage.UNIFORM,)


def left_out(sensors: Sequence[str]) -> str:
    """One line about the figure's rows that the drives have no sensors for; empty when there are none."""
    rows = [" + ".join(subset) for subset in FIGURE if not set(subset) <= set(sensors)]
    lacking = sorted({sensor for subset in FIGURE for sensor in subset} - set(sensors))
    return f"no {', '.join(lacking)} in both drives: left out {', '.join(rows)}" if rows else ""


@dataclass(frozen=True, slots=True)
class Row:
    """How a case did over all pairs of an experiment.

    ``told`` is what its posteriors say they know of the place, ``proven`` what the true places leave of that (``None``
    without a view on the map), averaged over views.
    """

    case: Case
    result: StageResult
    told: Information
    proven: Information | None


@dataclass(frozen=True, slots=True)
class Experiment:
    """Pairs of drives in the same lights, pooled: ``pairs`` of files, the number of query ``views``, and the rows."""

    name: str
    pairs: tuple[tuple[str, str], ...]
    views: int
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Ablation:
    """What is asked: pairs of files, reference and query."""

    pairs: Sequence[tuple[Path, Path]]
    every: bool = False
    features: Sequence[str] | None = None
    profile: Profile = field(default_factory=Profile)
    seed: int = 1


def pairs_of(drives: Sequence[Path]) -> tuple[tuple[Path, Path], ...]:
    """Drives two by two; ``ScenarioError`` for an odd number."""
    if len(drives) % 2:
        raise ScenarioError(f"{drives[-1]}: comes without a query; valid are pairs of a reference and a query")
    return tuple(zip(drives[::2], drives[1::2], strict=True))


_Answers = Mapping[Case, Comparison]
"""A query drive localised in every case."""


def run_ablation(ablation: Ablation, step: Callable[[str], object]) -> tuple[list[Experiment], tuple[str, ...]]:
    """The table of each experiment, and the sensors that all drives share. ``step`` is told what begins.

    Raises ``ScenarioError`` for a file that is not there, before any is read, and for drives without a common sensor or
    with other sensors than the first pair.
    """
    for path in itertools.chain.from_iterable(ablation.pairs):
        if not path.exists():
            raise ScenarioError(f"{path}: is no file; valid is a recording")
    found: dict[str, list[tuple[tuple[str, str], _Answers]]] = {}
    sensors: tuple[str, ...] = ()
    for first, later, sequence in _learnt(ablation, step):
        query = read_drive(later, None, None)
        shared = _shared_sensors(sequence, query, first, later)
        if sensors and shared != sensors:
            raise ScenarioError(
                f"{first}, {later}: share {', '.join(shared)}; valid is what the first pair does, {', '.join(sensors)}"
            )
        sensors = shared
        answers = answer(sequence, query, cases_of(sensors, every=ablation.every), seed=ablation.seed)
        found.setdefault(pair_name(sequence.metadata, query.metadata), []).append(((str(first), str(later)), answers))
    return [_experiment(name, pairs) for name, pairs in found.items()], sensors


def _learnt(ablation: Ablation, step: Callable[[str], object]) -> Iterator[tuple[Path, Path, ReferenceSequence]]:
    """Each pair with the map of its reference drive, which the next pair shares if it names the same file."""
    number = 0
    for first, same in itertools.groupby(ablation.pairs, key=lambda pair: pair[0]):
        step(f"learn {number + 1} of {len(ablation.pairs)}")
        drive = read_drive(first, None, None)
        sequence = learn(drive.views, features=ablation.features, profile=ablation.profile, metadata=drive.metadata)
        for _, later in same:
            number += 1
            step(f"localise {number} of {len(ablation.pairs)}")
            yield first, later, sequence


def answer(sequence: ReferenceSequence, query: Recording, cases: Sequence[Case], *, seed: int) -> _Answers:
    """A drive localised in every case; its features are found once. The comparisons keep no image."""
    once = replace(sequence, extractors=tuple(Remembering(extractor) for extractor in sequence.extractors))
    bare = tuple(View(time=view.time, distance=view.distance, turn=view.turn, truth=view.truth) for view in query.views)
    found = {}
    for sensors, group in itertools.groupby(cases, key=lambda case: case.sensors):
        same = tuple(group)
        stages = [case.stage for case in same]
        comparison = compare(
            pair_name(sequence.metadata, query.metadata), once, query, stages=stages, sensors=sensors, seed=seed
        )
        for case in same:
            found[case] = replace(comparison, query_views=bare, beliefs={case.stage: comparison.beliefs[case.stage]})
    return found


class Remembering:
    """An extractor that looks at each view only once, however many subsets of sensors ask for it."""

    def __init__(self, extractor: Extractor) -> None:
        self.key, self.sensor = extractor.key, extractor.sensor
        self._extractor = extractor
        # Views are kept beside what was seen in them, so that no other view can get the same id.
        self._seen: dict[int, tuple[View, Observed]] = {}

    @property
    def size(self) -> int:
        """How many features it knows."""
        return self._extractor.size

    def learn(self, view: View) -> NDArray[np.intp]:
        """Raise ``TypeError``: what was seen before would be out of date."""
        raise TypeError(f"{self.key} only observes")

    def observe(self, view: View) -> Observed:
        """Ids of the known features in a view, as found at the first time of asking."""
        if id(view) not in self._seen:
            self._seen[id(view)] = view, self._extractor.observe(view)
        return self._seen[id(view)][1]

    def describe(self, view: View) -> object:
        """What is to be seen of a view."""
        return self._extractor.describe(view)

    def recognise(self, described: object) -> NDArray[np.intp]:
        """Ids of the known features in it."""
        return self._extractor.recognise(described)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Arrays that, with the profile, make the extractor again."""
        return self._extractor.state()

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """What another's features are here."""
        return self._extractor.translated(state, size)


def _shared_sensors(sequence: ReferenceSequence, query: Recording, first: Path, later: Path) -> tuple[str, ...]:
    shared = tuple(sorted(sequence.sensors & query.sensors))
    if not shared:
        raise ScenarioError(
            f"{later}: its sensors ({', '.join(sorted(query.sensors)) or 'none'}) have none in common with those of "
            f"{first}; valid are {', '.join(sorted(sequence.sensors))}"
        )
    return shared


def _experiment(name: str, pairs: Sequence[tuple[tuple[str, str], _Answers]]) -> Experiment:
    answers = [of_pair for _, of_pair in pairs]
    rows = tuple(_row(case, [of_pair[case] for of_pair in answers]) for case in answers[0])
    views = sum(len(next(iter(of_pair.values())).query_views) for of_pair in answers)
    return Experiment(name, tuple(files for files, _ in pairs), views, rows)


def _row(case: Case, comparisons: Sequence[Comparison]) -> Row:
    told = [posterior_information([b.places for b in c.beliefs[case.stage]]) for c in comparisons]
    weights = [len(c.query_views) for c in comparisons]
    proven = [(len(on), proven_information(*zip(*on, strict=True))) for c in comparisons if (on := _on_map(c, case))]
    return Row(
        case,
        results(comparisons)[0],
        _pooled(weights, told),
        _pooled([count for count, _ in proven], [one for _, one in proven]) if proven else None,
    )


def _on_map(comparison: Comparison, case: Case) -> list[tuple[NDArray[np.float64], int]]:
    """Posterior and true place of each query view on the map: the place nearest to its true pose."""
    path = path_of(comparison)
    found = []
    for view, belief in zip(comparison.query_views, comparison.beliefs[case.stage], strict=True):
        place = path.nearest(view.truth)
        if place is not None and path.within(view.truth, WIDE).any():
            found.append((belief.places, place))
    return found


def _pooled(counts: Sequence[int], parts: Sequence[Information]) -> Information:
    """The mean over all views of several drives."""
    shares = np.array(counts) / sum(counts)
    bits, limits, errors = np.array([(part.bits, part.limit, part.error) for part in parts]).T
    return Information(float(shares @ bits), float(shares @ limits), float(np.hypot.reduce(shares * errors)))


# --- what is shown and written ---


def ablation_table(experiment: Experiment) -> Table:
    """The table on the terminal: success with 95 % intervals, failures, and what the views told."""
    pairs = f"{len(experiment.pairs)} pairs, " if len(experiment.pairs) > 1 else ""
    title = f"{experiment.name}: {pairs}{experiment.views} views"
    table = Table(title=Text(title), title_justify="left", title_style="bold", box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("sensors", no_wrap=True)
    for tolerance, share in experiment.rows[0].result.success.items():
        table.add_column(f"within {tolerance.distance:g} m\nof {share.trials} [95 %]", justify="right", no_wrap=True)
    for heading in ("failed", "told\n[bits]", "proven\n[bits]"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in experiment.rows:
        shares = map(str, row.result.success.values())
        proven = f"{row.proven.bits:.2f}" if row.proven else "n/a"
        table.add_row(_label(row.case), *shares, str(row.result.failures), f"{row.told.bits:.2f}", proven)
    return table


def _label(case: Case) -> str:
    """The case in words; context stands below the sensors that it is added to."""
    added = {Stage.UNIFORM: case.name, Stage.PRIOR: "  + motion prior", Stage.CHAIN: "    + chain"}
    return added[case.stage]


def check_table(path: Path) -> None:
    """Raise ``ScenarioError`` for a file's ending that no table has."""
    if path.suffix.lower() not in TABLES:
        raise ScenarioError(f"{path}: is no table's name; valid are names that end in {', '.join(TABLES)}")


def write_table(path: Path, experiments: Sequence[Experiment], ablation: Ablation) -> None:
    """Write all rows as CSV, or as JSON with everything that they depend on, replacing ``path`` in one step."""
    rows = [_record(experiment, row) for experiment in experiments for row in experiment.rows]
    replace_text(path, _csv(rows) if path.suffix.lower() == ".csv" else _json(rows, experiments, ablation))


def _csv(rows: Sequence[Mapping[str, object]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _json(rows: Sequence[Mapping[str, object]], experiments: Sequence[Experiment], ablation: Ablation) -> str:
    content = {
        "seed": ablation.seed,
        "features": list(ablation.features or ablation.profile.features),
        "profile": ablation.profile.to_dict(),
        "pairs": {experiment.name: experiment.pairs for experiment in experiments},
        "rows": rows,
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _record(experiment: Experiment, row: Row) -> dict[str, object]:
    """A row with the units in its columns' names; what there is no figure for is None."""
    found: dict[str, object] = {
        "experiment": experiment.name,
        "sensors": "+".join(row.case.sensors),
        "stage": row.case.stage.value,
        "pairs": len(experiment.pairs),
        "views": experiment.views,
    }
    for tolerance, share in row.result.success.items():
        within = f"within_{tolerance.distance:g}_m"
        low, high = share.interval
        found |= {f"{within}_right_views": share.successes, f"{within}_on_map_views": share.trials}
        percents = {"success": share.value, "low": low, "high": high}
        found |= {f"{within}_{name}_percent": _finite(100 * value) for name, value in percents.items()}
    found |= {"failures_views": row.result.failures, "lost_views": row.result.lost}
    proven = row.proven
    return found | {
        "limit_bits": _finite(row.told.limit),
        "told_bits": _finite(row.told.bits),
        "told_error_bits": _finite(row.told.error),
        "proven_bits": _finite(proven.bits) if proven else None,
        "proven_error_bits": _finite(proven.error) if proven else None,
    }


def _finite(value: float) -> float | None:
    return round(value, 4) if math.isfinite(value) else None
