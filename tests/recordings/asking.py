"""Where the recordings are, and one way to ask several profiles about them and print the scores.

The recordings are looked for in ``../shared/data`` beside this checkout, or where ``REFSEQ_RECORDINGS`` says. They are
no part of the project; a test whose recording is away is skipped.
"""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

from refseq.belief import Belief
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.map.profile import BEST, THESIS, Profile
from refseq.view import View
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import WIDE, Tolerance
from refseq_bench.scenarios.scoring.score import Score, pool, score

SEEDS = range(5)
DATA = Path(os.environ.get("REFSEQ_RECORDINGS") or Path(__file__).resolve().parents[2].parent / "shared" / "data")
PROFILES: Mapping[str, Profile] = MappingProxyType({"thesis": THESIS, "best": BEST})
LASER_PROFILES: Mapping[str, Profile] = MappingProxyType(
    {
        "thesis": THESIS,
        "thesis + sectors": replace(THESIS, features=(*THESIS.features, "sectors")),
        "best": BEST,
        "best + hu": replace(BEST, features=(*BEST.features, "hu")),
    }
)


def recording(name: str) -> Path:
    """The path of a recording; the test is skipped where it is not there."""
    path = DATA / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not beside this checkout")
    return path


def ask(
    name: str, profiles: Mapping[str, Profile], reference: Sequence[View], queries: Iterable[Sequence[View]]
) -> list[Comparison]:
    """Each query drive's answers by ``<profile>/<stage>``; a map is learnt once a profile."""
    maps = {label: learn(reference, profile=profile) for label, profile in profiles.items()}
    return [Comparison(name, reference, {}, query, {}, _answers(maps, query)) for query in queries]


def _answers(maps: Mapping[str, Map], query: Sequence[View]) -> dict[str, list[Belief]]:
    return {
        f"{label}/{stage}": beliefs for label, map_ in maps.items() for stage, beliefs in localise(map_, query).items()
    }


def laser_revisit(log: Path, reference: str, queries: Sequence[str]) -> list[Comparison]:
    """Stretches of a log localised in an earlier one, for odometry noise from each of the seeds.

    As ``refseq learn`` and ``refseq localise`` with ``--thin 0.5 --odometry-noise`` do it: the log's poses are
    corrected ones, so the motions between them are given noise, and then views are thinned.
    """
    return [
        comparison
        for seed in SEEDS
        for comparison in ask(
            log.name,
            LASER_PROFILES,
            read_drive(log, DriveSelection(reference, 0.5, noise_seed=seed)).views,
            [read_drive(log, DriveSelection(query, 0.5, noise_seed=len(SEEDS) + seed)).views for query in queries],
        )
    ]


def scores(comparisons: Sequence[Comparison], tolerance: Tolerance = WIDE) -> dict[str, Score]:
    """Each method's score over all comparisons."""
    return {method: pool([score(one, method, tolerance) for one in comparisons]) for method in comparisons[0].beliefs}


def print_scores(title: str, found: Mapping[str, Score], narrow: Mapping[str, Score] | None = None) -> None:
    """All figures of the page on the localiser, a row a method; ``narrow`` are the same at a second tolerance."""
    first = next(iter(found.values()))
    trials = [str(part.success.trials) for part in (first, *([next(iter(narrow.values()))] if narrow else []))]
    print(f"\n{title}: {' / '.join(trials)} views on the map, {int(first.off_map.sum())} off it")
    print(
        "method                    right, %       wrong  missed  false fixes  recall@1, %    AUC"
        "  recall at 100 %  lost AUROC"
    )
    for method, one in found.items():
        right = " / ".join(f"{100 * part.success.value:5.1f}" for part in (one, *([narrow[method]] if narrow else [])))
        curve = one.retrieval
        print(
            f"{method:25s}  {right:13s}  {one.count(Outcome.WRONG):5d}  {one.count(Outcome.MISSED):6d}"
            f"  {one.count(Outcome.FALSE_FIX):11d}"
            f"  {100 * one.recall(1).value:11.1f}  {curve.auc if curve else math.nan:.3f}"
            f"  {100 * (curve.recall_at(1.0) if curve else math.nan):15.1f}"
            f"  {'n/a' if one.auroc is None else format(one.auroc, '.3f'):>10s}"
        )
