"""Figures of several methods on the same views: pooled scores, time a view, and their record."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from refseq.belief import Timings
from refseq_bench.scenarios.scoring.atlas import AtlasScore, atlas_score, pool_atlas
from refseq_bench.scenarios.scoring.comparison import Comparison, shared_methods, single_view_of
from refseq_bench.scenarios.scoring.consistency.consistency import Consistency, consistency, pool_consistency
from refseq_bench.scenarios.scoring.intervals.bootstrap import interval_over_runs
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, ReferencePath, Tolerance, remembered_path_of
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.recovery import DistanceOrNever, median_way
from refseq_bench.scenarios.scoring.score import PLACES_OFF, RANKS, Score, harm, pool, score

STEPS = ("features", "matching", "mixture", "chain", "total")
"""Steps of answering a view, of which the time is told; those of ``refseq.belief.Timings``."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Median and 95th percentile."""

    median: float
    p95: float


@dataclass(frozen=True, slots=True)
class Figures:
    """One method over all views of some comparisons; ``cost`` is the median time a view takes without features [ms].

    ``wide_runs`` and ``narrow_runs`` are the same, a score a comparison. ``times`` [ms a view] are by step. ``harm``
    are the views that were answered wrong where the same method without their order answers right, of those; ``None``
    where there is no such method, or it did not answer. ``consistency``
    needs no truth. ``atlas`` is None where one drive was learnt.
    """

    method: str
    wide: Score
    narrow: Score
    cost: float
    wide_runs: tuple[Score, ...]
    narrow_runs: tuple[Score, ...]
    times: Mapping[str, Spread]
    harm: Proportion | None
    consistency: Consistency
    atlas: AtlasScore | None = None


_Run = tuple[Comparison, ReferencePath]
_Scores = Mapping[tuple[str, Tolerance], tuple[Score, ...]]


def figures(comparisons: Sequence[Comparison], wide: Tolerance = WIDE, narrow: Tolerance = NARROW) -> list[Figures]:
    """The figures of each method that all comparisons have answers of, within two tolerances."""
    methods, runs = shared_methods(comparisons), [(one, remembered_path_of(one)) for one in comparisons]
    scores = {
        (method, near): tuple(score(one, method, near, path) for one, path in runs)
        for method in methods
        for near in (wide, narrow)
    }
    return [_figures(runs, method, scores, wide, narrow) for method in methods]


def step_times(timings: Sequence[Timings]) -> Mapping[str, Spread]:
    """The time that each step takes a view [ms], of one view at least."""
    return MappingProxyType({step: _spread([1000 * getattr(one, step) for one in timings]) for step in STEPS})


def _figures(runs: Sequence[_Run], method: str, scores: _Scores, wide: Tolerance, narrow: Tolerance) -> Figures:
    comparisons = [one for one, _ in runs]
    timings = [belief.timings for one in comparisons for belief in one.beliefs[method]]
    wide_runs, narrow_runs = scores[method, wide], scores[method, narrow]
    pooled = pool(wide_runs)
    single = scores.get((single_view_of(method) or "", wide))
    return Figures(
        method=method,
        wide=pooled,
        narrow=pool(narrow_runs),
        cost=1000 * float(np.median([timing.total - timing.features for timing in timings])),
        wide_runs=wide_runs,
        narrow_runs=narrow_runs,
        times=step_times(timings),
        harm=harm(pooled, pool(single)) if single and pooled.scored else None,
        consistency=pool_consistency([consistency(one, method, wide) for one in comparisons]),
        atlas=_atlas(runs, method, wide),
    )


def _atlas(runs: Sequence[_Run], method: str, wide: Tolerance) -> AtlasScore | None:
    if any(one.drives is None or len(one.drives.names) == 1 for one, _ in runs):
        return None
    return pool_atlas([atlas_score(one, method, wide, path) for one, path in runs])


def _spread(values: Sequence[float]) -> Spread:
    return Spread(float(np.median(values)), float(np.quantile(values, 0.95)))


def figures_csv(experiments: Sequence[tuple[str, Sequence[Figures]]]) -> str:
    """All figures as a table of comma-separated values, units in the columns' names; empty where there is none.

    Experiments of other tolerances, and of several drives, have columns of their own.
    """
    text = io.StringIO()
    rows = [
        {"experiment": name, "method": one.method, **figures_record(one)}
        for name, found in experiments
        for one in found
    ]
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    if rows:
        writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def figures_record(one: Figures) -> dict[str, float | None]:
    """All figures of a method by their names, units in them; None where there is none."""
    wide, curve = one.wide, one.wide.retrieval
    record = _success_record(one.wide, one.wide_runs) | _success_record(one.narrow, one.narrow_runs)
    record |= {f"within_{n}_places_right_views": _scored(wide, wide.within_places(n).successes) for n in PLACES_OFF}
    record |= {f"recall_at_{n}_percent": _finite(100 * wide.recall(n).value) for n in RANKS}
    return record | {
        "failures_views": _scored(wide, wide.failures),
        "accuracy_percent": _finite(100 * wide.accuracy.value),
        "off_map_views": _scored(wide, int(wide.off_map.sum())),
        "false_fixes_views": _scored(wide, wide.count(Outcome.FALSE_FIX)),
        "worst_false_fix_m": _finite(wide.worst_false_fix),
        "false_fixes_unknown_views": _scored(wide, wide.unknown_false_fixes),
        "auc": _finite(curve.auc) if curve else None,
        "recall_at_precision_100_percent": _finite(100 * curve.recall_at(1.0)) if curve else None,
        "recall_at_precision_99_percent": _finite(100 * curve.recall_at(0.99)) if curve else None,
        "ece": _finite(wide.mass_reliability.error),
        "lost_ece": _finite(wide.lost_reliability.error),
        "lost_auroc": _finite(wide.auroc),
        "lost_fpr_at_95_tpr": _finite(wide.false_alarms),
        "error_median_m": _finite(wide.error_quantile(0.5)),
        "error_p95_m": _finite(wide.error_quantile(0.95)),
        "error_unknown_views": _scored(wide, wide.unknown_errors),
        "without_features_ms": _finite(one.cost),
        "without_truth_views": wide.count(Outcome.UNSCORED),
        "entropy_auroc": _finite(wide.entropy_auroc),
        "posterior_bits": _finite(wide.information),
        "proven_bits": _finite(wide.proven_information),
        "harm_views": None if one.harm is None else one.harm.successes,
        "harm_of_views": None if one.harm is None else one.harm.trials,
        "last_sure_median_m": _finite(wide.last_sure_median),
        "last_sure_told_views": _scored(wide, int(np.isfinite(wide.last_sure).sum())),
        **_ways_record("first_fix", wide.first_fixes),
        **_ways_record("to_lost", wide.recovery.to_lost),
        **_ways_record("to_recover", wide.recovery.to_recover),
        **{f"{step}_median_ms": _finite(one.times[step].median) for step in STEPS},
        **{f"{step}_p95_ms": _finite(one.times[step].p95) for step in STEPS},
        **consistency_record(one.consistency),
        **({} if one.atlas is None else _atlas_record(one.atlas)),
    }


def _scored(wide: Score, count: int) -> int | None:
    """A number of views that were judged; None where none could be."""
    return count if wide.scored else None


def consistency_record(found: Consistency) -> dict[str, float | None]:
    """Figures that need no truth by their names, units in them; None where there is none."""
    return {
        "says_lost_percent": _finite(100 * found.lost.value),
        "odometry_jumps_steps": found.jumps.successes if found.jumps.trials else None,
        "odometry_jumps_of_steps": found.jumps.trials,
        "odometry_slope": _finite(found.fit.slope),
        "odometry_residual_m": _finite(found.fit.residual),
        "entropy_mean_nats": _finite(found.entropy),
        "agreement_percent": _finite(100 * found.agreement.value),
    }


def _success_record(pooled: Score, runs: Sequence[Score]) -> dict[str, float | None]:
    within, (low, high) = f"within_{pooled.tolerance.distance:g}_{pooled.tolerance.unit}", pooled.success.interval
    seeds = success_over_seeds(runs) or (None, None)
    shares = {"low": low, "high": high, "seeds_low": seeds[0], "seeds_high": seeds[1]}
    return {
        f"{within}_right_views": _scored(pooled, pooled.success.successes),
        f"{within}_on_map_views": pooled.success.trials,
        **{
            f"{within}_{name}_percent": None if share is None else _finite(100 * share)
            for name, share in shares.items()
        },
    }


def _atlas_record(atlas: AtlasScore) -> dict[str, float | None]:
    shares = {
        f"sequence_{where}_mean": _finite(float(np.mean(part))) if part else None
        for where, part in atlas.shares._asdict().items()
    }
    record = {**_ways_record("fork", atlas.forks), **shares, "jumps_views": atlas.jumps}
    if (joined := atlas.joined) is None:
        return record
    return record | {
        "joins_precision_right_views": joined.precision.successes,
        "joins_precision_of_views": joined.precision.trials,
        "joins_recall_joined_views": joined.recall.successes,
        "joins_recall_of_views": joined.recall.trials,
        "duplicate_places": joined.duplicates,
        "joins": joined.joins,
        "false_joins": joined.false_joins,
        "overlooked_joins": joined.overlooked,
        "atlas_places": joined.places,
        "learnt_views": joined.views,
        "maps_bytes": joined.bytes_before,
        "atlas_bytes": joined.bytes_after,
        "merging_s": _finite(joined.seconds),
    }


def success_over_seeds(runs: Sequence[Score]) -> tuple[float, float] | None:
    """The 95 % interval of success over seeds, as shares; ``None`` for a single one."""
    return interval_over_runs([one.success for one in runs])


def _ways_record(name: str, ways: Sequence[DistanceOrNever]) -> dict[str, float | None]:
    return {
        f"{name}_median_m": _finite(median_way(ways)),
        f"{name}_times": len(ways),
        f"{name}_never_times": ways.count(None),
    }


def _finite(value: float | None) -> float | None:
    return round(value, 4) if value is not None and math.isfinite(value) else None
