"""Seek the point of a scenario's dials at which a method does worst."""

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.run.workers import WorkerPool
from refseq_bench.scenarios.campaign.search.dials import Dial, Point, Scale, Value, at_point
from refseq_bench.scenarios.campaign.store.cache import Store

if TYPE_CHECKING:
    import optuna

RANDOM_SHARE = 0.3
"""Part of the budget that is drawn evenly before the sampler models what it saw: a choice."""
TRIES = 2
"""Times the budget that points are tried at most, those among them at which nobody could drive."""
HARMLESS = 1.0
"""Success that the sampler is told of a point at which nobody could drive; told nothing, it would ask for it again."""


@dataclass(frozen=True)
class Found:
    """Success of a method at a point, as shares within two tolerances; nan, with a reason, where nobody could drive."""

    point: Point
    success: float
    narrow: float
    reason: str = ""

    @property
    def value(self) -> float:
        """Lower is worse: the mean of both shares, since most points have all views right within the wider one."""
        return (self.success + self.narrow) / 2


class Prober:
    """Runs a case with its dials turned; a point is run once, and what is in the store not at all."""

    def __init__(self, case: Case, dials: Mapping[str, Dial], executor: WorkerPool, store: Store) -> None:
        self._case, self._dials, self._executor, self._store = case, dials, executor, store
        self._known: dict[frozenset[tuple[str, object]], Found] = {}

    def __call__(self, point: Point) -> Found:
        """Drive, ask, and score."""
        turned = {name: value for name, value in point.items() if value != self._dials[name].easy}
        key = frozenset(turned.items())
        if key not in self._known:
            self._known[key] = self._run(turned)
        return self._known[key]

    def _run(self, point: Point) -> Found:
        case = at_point(self._case, self._dials, point)
        (judged,) = run_campaign([case], self._executor, self._store, Watcher())
        found = next((one for one in judged.figures if one.method == case.scenario.judged), None)
        if found is None or len(judged.answered) < len(case.scenario.seeds) or not found.wide.success.trials:
            return Found(point, math.nan, math.nan, next(iter(judged.reasons), "no view was on the map"))
        return Found(point, found.wide.success.value, found.narrow.success.value)


def seek(probe: Callable[[Point], Found], dials: Mapping[str, Dial], budget: int, seed: int) -> Iterator[Found]:
    """Run ``budget`` points, of which each is chosen by those before it; yields each.

    The sampler is Optuna's tree-structured Parzen estimator (J. Bergstra et al., NeurIPS 2011) over all dials together.
    The same seed seeks the same points. One at which nobody could drive does not count, until there are as many such.
    """
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler = optuna.samplers.TPESampler(
            seed=seed, multivariate=True, n_startup_trials=max(2, math.ceil(RANDOM_SHARE * budget))
        )
    study = optuna.create_study(sampler=sampler)
    driven = 0
    for _ in range(TRIES * budget):
        trial = study.ask()
        found = probe({name: _drawn(trial, name, dial) for name, dial in dials.items()})
        could_drive = not math.isnan(found.value)
        study.tell(trial, found.value if could_drive else HARMLESS)
        yield found
        driven += could_drive
        if driven == budget:
            return


def _drawn(trial: "optuna.Trial", name: str, dial: Dial) -> Value:
    """The value of a dial that the sampler chose."""
    if isinstance(dial, Scale):
        return dial.values[trial.suggest_int(name, 0, len(dial.values) - 1)]
    return str(trial.suggest_categorical(name, dial.words))
