"""Scenarios for programs: run declared experiments, score what a localiser answered."""

from collections.abc import Sequence
from pathlib import Path

from refseq.belief import Belief
from refseq.logs import Recording
from refseq.map.map import Map
from refseq_bench.scenarios.campaign.campaign import Watcher, leave_it, run_campaign
from refseq_bench.scenarios.campaign.declare.cases import find
from refseq_bench.scenarios.campaign.declare.overrides import with_methods, with_renderer, with_seeds
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.results import Results
from refseq_bench.scenarios.campaign.run.workers import LocalWorkers
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.evaluate import comparison_of
from refseq_bench.scenarios.scoring import score as scorer
from refseq_bench.scenarios.scoring.path_geometry import WIDE, Tolerance
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.user_cache import user_cache

ANSWERS = "localiser"


def run(
    *scenarios: str | Path,
    localisers: Sequence[str] = (),
    methods: Sequence[str] | None = None,
    seeds: Sequence[int] | None = None,
    renderer: RendererKind | None = None,
    output: Path | None = None,
    cache: Path | None = None,
    workers: int = 1,
) -> list[Judged]:
    """Run scenarios by name, tag or path (.toml); return each case's verdict, reasons, figures and comparisons.

    ``localisers`` (``package.module:Class``) are judged in the scenarios' stead, beside ``methods`` only; ``seeds`` and
    the ``renderer`` of cameras' pictures replace those of the scenarios. Pages are written to the folder ``output``, if
    there is one; recordings, maps and answers are kept in ``cache``, by default where ``refseq scenario run`` keeps
    them. Raises ``ScenarioError``.
    """
    numbers = None if seeds is None else ",".join(map(str, seeds))
    declared = find([str(one) for one in scenarios], rejudged=bool(localisers))
    cases = with_renderer(with_seeds(with_methods(declared, localisers, methods), numbers), renderer)
    store = Store(cache or user_cache())
    results = None if output is None else Results(output, cases, store)
    executor, finished = LocalWorkers(workers, store.folder), False
    try:
        found = list(run_campaign(cases, executor, store, Watcher(), conclude=results.add if results else leave_it))
        finished = True
    finally:
        executor.close(at_once=not finished)
        if results is not None:
            results.close()
    return found


def score(beliefs: Sequence[Belief], recording: Recording, map_: Map, *, tolerance: Tolerance = WIDE) -> scorer.Score:
    """Score the answers to a recording, one a view, against the map that they are about.

    ``tolerance`` says how near to the truth an answer must be. Raises ``ScenarioError`` for answers that do not fit the
    recording or the map. Where the map or the recording has no true pose, no view is scored.
    """
    comparison = comparison_of("recording", map_, recording, {ANSWERS: beliefs})
    return scorer.score(comparison, ANSWERS, tolerance)
