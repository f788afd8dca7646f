"""The report of a run: one HTML page that needs nothing beside it."""

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import cv2
import jinja2
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Stage, Timings
from refseq.files import replace_text
from scenarios import plots
from scenarios.comparison import Comparison, method_label, shared_methods, single_view_of
from scenarios.episodes import Way
from scenarios.errors import ScenarioError
from scenarios.outcome import Outcome
from scenarios.plots import FloorOutline, Plot
from scenarios.score import NARROW, RANKS, WIDE, Proportion, ReferencePath, Score, harm, pool, score

FRAME_WIDTH = 320
"""Width of a sample frame [pixels]."""

PLACES_SHOWN = 4
"""Matching places whose frames are shown for each comparison."""

LONG_VALUE = 80
"""Metadata longer than this many characters are folded away."""

NONE = "n/a"
"""Stands in a table where there is no figure to give."""

FIRST_KEYS = ("world", "robot", "light", "seed")


def write_report(
    path: Path, comparisons: Sequence[Comparison], *, title: str, outline: FloorOutline | None = None
) -> None:
    """Write the report of some comparisons to ``path``, replacing it in one step.

    Comparisons of the same name are seeds of one experiment: they are pooled in the tables, and the first of them is
    drawn. ``outline`` are the world's walls as polylines of (m, 2) points [m]. Raises ``ScenarioError`` without any
    comparison.
    """
    if not comparisons:
        raise ScenarioError("a report of 0 comparisons; valid is at least one")
    groups = [_Group(name, tuple(c for c in comparisons if c.name == name)) for name in _names(comparisons)]
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("scenarios"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    page = environment.get_template("report.html.j2").render(
        title=title,
        facts=_facts(comparisons),
        details=_details(comparisons),
        experiments=[_experiment(group, outline) for group in groups],
        wide=WIDE,
        narrow=NARROW,
    )
    replace_text(path, page)


@dataclass(frozen=True)
class _Group:
    """Comparisons of one name."""

    name: str
    runs: tuple[Comparison, ...]

    @property
    def methods(self) -> list[str]:
        """Methods that all runs have answers of."""
        return shared_methods(self.runs)

    @property
    def scorable(self) -> bool:
        """Whether true poses are known on both sides."""
        return all(_has_truth(run) for run in self.runs)


@dataclass(frozen=True)
class Frames:
    """Pictures of one place, reference above query for each camera, as data URIs."""

    caption: str
    pairs: tuple[tuple[str, str | None, str | None], ...]


@dataclass(frozen=True)
class MethodRow:
    """One method's figures, in words."""

    label: str
    views: int
    success: str
    success_narrow: str
    failures: str
    median: str
    p95: str


@dataclass(frozen=True)
class FurtherRow:
    """More figures of one method, in words."""

    label: str
    outcomes: str
    first_fix: str
    harm: str
    auc: str
    recall: str
    first_places: str
    calibration: str


@dataclass(frozen=True)
class LostRow:
    """How one method did off the map, in words."""

    label: str
    auroc: str
    false_alarms: str
    calibration: str
    to_lost: str
    to_recover: str
    worst: str


@dataclass(frozen=True)
class Experiment:
    """What the page shows of the comparisons of one name."""

    name: str
    runs: int
    drawn: str
    table: tuple[MethodRow, ...]
    further: tuple[FurtherRow, ...]
    lost_table: tuple[LostRow, ...]
    unscored: int
    best: str
    plan: Plot | None
    posterior: Plot | None
    lost: Plot | None
    errors: Plot | None
    reliability: Plot | None
    certainty: Plot | None
    frames: tuple[Frames, ...]
    methods: tuple[str, ...]
    cost: tuple[tuple[str, tuple[str, ...]], ...]


def _experiment(group: _Group, outline: FloorOutline | None) -> Experiment:
    # Plots show the methods that the tables show, in the same order.
    methods = group.methods
    first = replace(group.runs[0], beliefs={method: group.runs[0].beliefs[method] for method in methods})
    path = ReferencePath(first.reference_views) if group.scorable else None
    wide = {method: [score(run, method, WIDE) for run in group.runs] for method in methods} if path else {}
    pooled = {method: pool(scores) for method, scores in wide.items()}
    drawn = {method: scores[0] for method, scores in wide.items()}
    return Experiment(
        name=group.name,
        runs=len(group.runs),
        drawn=_drawn(group),
        table=tuple(_method_row(group, method, pooled[method]) for method in pooled),
        further=tuple(_further_row(method, pooled) for method in pooled),
        lost_table=tuple(_lost_row(method, total) for method, total in pooled.items() if total.off_map.any()),
        unscored=next((total.count(Outcome.UNSCORED) for total in pooled.values()), 0),
        best=method_label(_marked(methods)) if methods else "",
        plan=plots.plan(first, drawn[_marked(methods)], outline) if drawn else None,
        posterior=plots.posterior(first, path) if methods else None,
        lost=plots.lost(first, path) if methods else None,
        errors=plots.errors(first, drawn, path) if path and drawn else None,
        reliability=plots.reliability(pooled) if pooled else None,
        certainty=plots.certainty(first, drawn) if drawn else None,
        frames=tuple(_frames(first, path)),
        methods=tuple(method_label(method) for method in methods),
        cost=tuple(_cost(group)),
    )


def _marked(methods: Sequence[str]) -> str:
    """The method whose answers are marked in the plan: the thesis' last stage, or the last method without any."""
    return next((stage for stage in reversed(Stage) if stage in methods), methods[-1])


def _drawn(group: _Group) -> str:
    """Which of several runs is drawn."""
    if len(group.runs) == 1:
        return ""
    seed = group.runs[0].query_metadata.get("seed")
    return f"the first of {len(group.runs)} runs" + (f" (query seed {seed})" if seed is not None else "")


# --- tables ---


def _method_row(group: _Group, method: str, pooled: Score) -> MethodRow:
    narrow = pool([score(run, method, NARROW) for run in group.runs])
    return MethodRow(
        label=method_label(method),
        views=pooled.success.trials,
        success=_share(pooled.success),
        success_narrow=f"{_share(narrow.success)}, n = {narrow.success.trials}",
        failures=f"{pooled.failures} of {pooled.success.trials}",
        median=_metres(pooled.error_quantile(0.5)),
        p95=_metres(pooled.error_quantile(0.95)),
    )


def _further_row(method: str, scores: Mapping[str, Score]) -> FurtherRow:
    pooled = scores[method]
    curve = pooled.retrieval
    single = single_view_of(method)
    spoilt = harm(pooled, scores[single]) if single in scores else None
    kinds = (Outcome.WRONG, Outcome.MISSED, Outcome.FALSE_FIX, Outcome.REJECTED)
    return FurtherRow(
        label=method_label(method),
        outcomes=" / ".join(str(pooled.count(kind)) for kind in kinds),
        first_fix=_ways(pooled.first_fixes),
        harm=NONE if spoilt is None else f"{spoilt.successes} of {spoilt.trials}",
        auc=NONE if curve is None else f"{curve.auc:.3f}",
        recall=NONE if curve is None else f"{100 * curve.recall_at(1.0):.0f} / {100 * curve.recall_at(0.99):.0f} %",
        first_places=_first_places(pooled),
        calibration=_number(pooled.top_reliability.error),
    )


def _lost_row(method: str, pooled: Score) -> LostRow:
    return LostRow(
        label=method_label(method),
        auroc=NONE if pooled.auroc is None else f"{pooled.auroc:.3f}",
        false_alarms=NONE if pooled.false_alarms is None else f"{100 * pooled.false_alarms:.0f} %",
        calibration=_number(pooled.lost_reliability.error),
        to_lost=_ways(pooled.episodes.to_lost),
        to_recover=_ways(pooled.episodes.to_recover),
        worst=_metres(pooled.worst_false_fix),
    )


def _first_places(pooled: Score) -> str:
    """Recall at 1, 5 and 10 places [%]."""
    recalls = [pooled.recall(first) for first in RANKS]
    return NONE if not recalls[0].trials else " / ".join(f"{100 * share.value:.0f}" for share in recalls) + " %"


def _ways(ways: Sequence[Way]) -> str:
    """Median, and how many never got there."""
    found = [way for way in ways if way is not None]
    never = len(ways) - len(found)
    return (_metres(float(np.median(found))) if found else NONE) + (f" ({never} never)" if never else "")


def _cost(group: _Group) -> Iterable[tuple[str, tuple[str, ...]]]:
    """For each step the median and 95th percentile of the time a view takes, by method; nothing where none was."""
    taken = {m: [belief.timings for run in group.runs for belief in run.beliefs[m]] for m in group.methods}
    if not any(timings.total for all_timings in taken.values() for timings in all_timings):
        return
    for step in [*(field.name for field in fields(Timings)), "total"]:
        times = ([1000 * getattr(timings, step) for timings in taken[method]] for method in group.methods)
        yield step, tuple(f"{np.median(t):.2f} / {np.quantile(t, 0.95):.2f}" for t in times)


def _share(proportion: Proportion) -> str:
    """Write a success rate in per cent with its 95 % interval."""
    if not proportion.trials:
        return NONE
    low, high = proportion.interval
    return f"{100 * proportion.value:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def _metres(value: float) -> str:
    return NONE if math.isnan(value) else f"{value:.2f} m"


def _number(value: float) -> str:
    return NONE if math.isnan(value) else f"{value:.3f}"


# --- what was run ---


def _names(comparisons: Sequence[Comparison]) -> list[str]:
    return list(dict.fromkeys(comparison.name for comparison in comparisons))


def _facts(comparisons: Sequence[Comparison]) -> list[tuple[str, str, str]]:
    """Short metadata as (key, values of the reference drives, values of the query drives)."""
    reference = _values(comparison.reference_metadata for comparison in comparisons)
    query = _values(comparison.query_metadata for comparison in comparisons)
    keys = sorted({*reference, *query}, key=_key_order)
    rows = [(key, ", ".join(reference.get(key, (NONE,))), ", ".join(query.get(key, (NONE,)))) for key in keys]
    return [row for row in rows if max(map(len, row[1:])) <= LONG_VALUE]


def _details(comparisons: Sequence[Comparison]) -> list[tuple[str, str]]:
    """Long metadata, such as the resolved configuration, as (which, text)."""
    found = {}
    for side in ("reference", "query"):
        values = _values(getattr(comparison, f"{side}_metadata") for comparison in comparisons)
        found |= {f"{side}: {k}": "\n".join(v) for k, v in values.items() if len(", ".join(v)) > LONG_VALUE}
    return sorted(found.items())


def _values(drives: Iterable[Mapping[str, object]]) -> dict[str, tuple[str, ...]]:
    """All distinct values of each key, nested ones under ``outer.inner``."""
    seen: dict[str, dict[str, None]] = {}
    for metadata in drives:
        for key, value in _flat(metadata):
            seen.setdefault(key, {})[str(value)] = None
    return {key: tuple(values) for key, values in seen.items()}


def _flat(metadata: Mapping[str, object], prefix: str = "") -> Iterable[tuple[str, object]]:
    for key, value in metadata.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _key_order(key: str) -> tuple[int, str]:
    """Put what was driven first, then the rest by name."""
    return (FIRST_KEYS.index(key) if key in FIRST_KEYS else len(FIRST_KEYS)), key


# --- frames ---


def _has_truth(comparison: Comparison) -> bool:
    sides = (comparison.reference_views, comparison.query_views)
    return all(any(view.truth for view in views) for views in sides)


def _frames(comparison: Comparison, path: ReferencePath | None) -> Iterable[Frames]:
    """Pictures of a few places spread over the query drive."""
    matches = list(_matches(comparison, path))
    cameras = sorted({camera for view in comparison.query_views for camera in view.images})
    if not (matches and cameras):
        return
    for i in range(PLACES_SHOWN):
        t, k, caption = matches[(2 * i + 1) * len(matches) // (2 * PLACES_SHOWN)]
        reference, query = comparison.reference_views[k], comparison.query_views[t]
        pairs = tuple((c, _picture(reference.images.get(c)), _picture(query.images.get(c))) for c in cameras)
        yield Frames(caption, pairs)


def _matches(comparison: Comparison, path: ReferencePath | None) -> Iterable[tuple[int, int, str]]:
    """Query views with the place that shows the same: the nearest in truth, or the best answer where none is known."""
    for t, view in enumerate(comparison.query_views):
        if path is not None and view.truth is not None:
            k = path.nearest(view.truth)
            if k is not None and path.within(view.truth, WIDE)[k]:
                away = math.hypot(*(path.points[k] - (view.truth.x, view.truth.y)))
                yield t, k, f"query view {t}, reference place {k}, {away:.2f} m apart"
        elif path is None and comparison.beliefs:
            k = comparison.beliefs[_marked(shared_methods([comparison]))][t].best
            yield t, k, f"query view {t}, reference place {k} (the answer: no truth is known)"


def _picture(image: NDArray[np.uint8] | None) -> str | None:
    """Encode a frame as a small JPEG data URI."""
    if image is None:
        return None
    height, width = image.shape
    small = cv2.resize(image, (FRAME_WIDTH, round(FRAME_WIDTH * height / width)), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
