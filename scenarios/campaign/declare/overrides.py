"""Override what scenarios declare: localisers of a user, fewer methods, other seeds, another renderer."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.checks.by_type import checks_for
from refseq_bench.scenarios.campaign.declare.checks.runnable import (
    check_chosen_elsewhere,
    check_drawn,
    check_drives_apart,
    check_judged,
)
from refseq_bench.scenarios.campaign.declare.expectations import about
from refseq_bench.scenarios.campaign.declare.schema import Declared, DriveTable, SourceTable
from refseq_bench.scenarios.errors import ScenarioError, named
from refseq_bench.scenarios.methods.names import written_out
from refseq_bench.scenarios.tables import plural
from refseq_bench.sim.rendering.renderer import RendererKind

NOBODY = "none"
"""Stands for no method, where methods are named."""
TRAINING = "training"
"""Stands for a scenario's training seeds, where seeds are named."""


def with_methods(cases: Sequence[Case], localisers: Sequence[str], methods: Sequence[str] | None) -> list[Case]:
    """The same cases with ``localisers`` judged, and beside them ``methods`` only; None: those of each scenario.

    Without a localiser the method that was judged stays so where it runs; else the first one that runs is, and
    expectations name who was meant. What an expectation says without naming a method is meant of the first localiser,
    and once more of each other one. Those that name a method which does not run are left to be told as not judged.

    Raises ``ScenarioError`` for a name that is no method's, and for a method that a case cannot ask, before anything is
    run.
    """
    judged = tuple(dict.fromkeys(localisers))
    type_checks = {checks_for(case.scenario) for case in cases}
    others = None if methods is None else tuple(name for name in methods if name != NOBODY)
    for checks in type_checks:
        checks.check_names((*judged, *written_out(others or ())))
    if not judged and others == ():
        raise ScenarioError("methods 'none': nobody is left to be asked; valid is to name a localiser or a method")
    return [_with_methods(case, judged, others) for case in cases] if judged or methods is not None else list(cases)


def _with_methods(case: Case, judged: Sequence[str], others: Sequence[str] | None) -> Case:
    scenario = case.scenario
    running = written_out((*(scenario.methods if others is None else others), *judged), scenario.localise.sensors)
    first = _judged_among(running, scenario, judged)
    # Who was judged is named, for it may not run now, and nobody else's figures are to be taken for its; so is each of
    # several localisers.
    meant = tuple(judged) or (scenario.judged,)
    told = [about(one, name) for name in meant for one in case.expectations]
    expected = case.expectations if meant == (first,) else tuple(dict.fromkeys(told))
    localise = scenario.localise.model_copy(update={"methods": running, "judged": first})
    asked = scenario.model_copy(update={"localise": localise})
    type_checks = checks_for(asked)
    with named(case.name):
        type_checks.check_methods(asked)
        check_judged(asked)
        type_checks.check(asked, case.file, case.sources(asked.seeds[0])[:-1])
    found = replace(case, scenario=asked, expectations=expected)
    check_chosen_elsewhere(found)
    return found


def _judged_among(running: Sequence[str], scenario: Declared, localisers: Sequence[str]) -> str:
    """The method to be judged of those that run: a localiser, else who is declared, else the first one."""
    return next(iter(localisers), scenario.judged if scenario.judged in running else running[0])


def judged_instead(declared: Sequence[Case], asked: Sequence[Case]) -> Iterator[str]:
    """Lines on the methods that are judged for want of the declared ones, which do not run; cases pair by pair."""
    pairs = [(was.scenario.judged, now.scenario) for was, now in zip(declared, asked, strict=True)]
    replaced = Counter((was, now.judged) for was, now in pairs if was not in now.methods)
    for (was, now), count in replaced.items():
        yield f"{was}, which is judged in {plural(count, 'case')}, does not run; {now} is judged there"


def with_seeds(cases: Sequence[Case], seeds: str | None) -> list[Case]:
    """The same cases with other seeds, written with commas between; None: their own. Raises ``ScenarioError``.

    ``training`` stands for the seeds on which parameters may be chosen. By their numbers these are refused: a test on
    them is none.
    """
    if seeds is None:
        return list(cases)
    if seeds == TRAINING:
        return [_with_seeds(case, _training(case)) for case in cases]
    texts = [text.strip() for text in seeds.split(",")]
    if not all(text.isascii() and text.isdigit() for text in texts) or len({int(text) for text in texts}) < len(texts):
        raise ScenarioError(f"--seeds {seeds!r} is not valid; it should be whole numbers that differ, commas between")
    numbers = tuple(map(int, texts))
    for case in cases:
        if both := sorted({*numbers} & {*case.scenario.training_seeds}):
            raise ScenarioError(
                f"--seeds {seeds}: {case.name} has {both} for training, and is tested on others; valid are other "
                f"numbers, or '{TRAINING}' to choose parameters"
            )
    found = [_with_seeds(case, numbers) for case in cases]
    for case in found:
        with named(case.name):
            check_drawn(case)
            check_drives_apart(case)
        check_chosen_elsewhere(case)
    return found


def _with_seeds(case: Case, seeds: tuple[int, ...]) -> Case:
    return replace(case, scenario=case.scenario.model_copy(update={"seeds": seeds}))


def _training(case: Case) -> tuple[int, ...]:
    if not case.scenario.training_seeds:
        raise ScenarioError(f"--seeds {TRAINING}: {case.name} has no training_seeds; valid are whole numbers")
    return case.scenario.training_seeds


def with_renderer(cases: Sequence[Case], renderer: RendererKind | None) -> list[Case]:
    """The same cases with pictures by another renderer wherever cameras take some; None: by their own."""
    if renderer is None:
        return list(cases)

    def other(table: SourceTable) -> SourceTable:
        pictured = isinstance(table, DriveTable) and table.renderer is not RendererKind.NONE
        return table.model_copy(update={"renderer": renderer}) if pictured else table

    return [with_sources(case, other) for case in cases]


def with_sources(case: Case, other: Callable[[Any], SourceTable]) -> Case:
    """The same case with ``other`` tables for its references and its query."""
    declared = case.scenario
    tables = {
        "reference": other(declared.reference),
        "further": tuple(map(other, declared.further)),
        "query": other(declared.query),
    }
    return replace(case, scenario=declared.model_copy(update=tables))
