"""Check that cases can be run, as far as that can be told before the first drive."""

from collections.abc import Sequence

from refseq_bench.scenarios.campaign.declare.case import Case, of_seed
from refseq_bench.scenarios.campaign.declare.checks.by_type import checks_for
from refseq_bench.scenarios.campaign.declare.checks.drivable import check_drive, check_learnable, check_signal_faults
from refseq_bench.scenarios.campaign.declare.drive_seeds import added_seeds, check_apart
from refseq_bench.scenarios.campaign.declare.expectations import check_decides
from refseq_bench.scenarios.campaign.declare.schema import ONLY_SEED, Declared, DriveTable, Scenario, is_drawn
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError, named
from refseq_bench.scenarios.methods.chosen_on import refuse_chosen_on


def check_runnable(cases: Sequence[Case], *, rejudged: bool = False) -> None:
    """Raise for the first of a file's cases that cannot be run; of drives that are alike one is checked.

    Where others are judged in their stead (``rejudged``), expectations are not held against who is judged by the file.
    """
    checked = set[str]()
    for case in cases:
        _check(case, checked)
        if not rejudged:
            _check_expectations_decide(case)


def _check_expectations_decide(case: Case) -> None:
    """Raise ``ScenarioError`` for an expectation that compares the judged method with itself."""
    for expectation in case.expectations:
        with named("expect"):
            check_decides(expectation, case.scenario.judged)


def check_chosen_elsewhere(case: Case) -> None:
    """Raise ``ScenarioError`` where a case that keeps seeds for training tests a method on a world it was chosen in."""
    scenario = case.scenario
    if scenario.training_seeds and not {*scenario.seeds} & {*scenario.training_seeds}:
        tables = [table for table in (*scenario.references, scenario.query) if isinstance(table, DriveTable)]
        refuse_chosen_on(scenario.methods, (of_seed(table.world, seed) for table in tables for seed in scenario.seeds))


def check_drawn(case: Case) -> None:
    """Raise ``ScenarioError`` for several seeds from which nothing is drawn.

    All would have the same views, and what is one drive would be taken for so many when differences are judged.
    """
    scenario = case.scenario
    if len(scenario.seeds) > 1 and not scenario.is_drawn:
        raise ScenarioError(
            f"seeds: {list(scenario.seeds)}: nothing is drawn from a seed here, and the same views would be counted "
            f"{len(scenario.seeds)} times; valid is one seed, such as {list(ONLY_SEED)}"
        )


def check_drives_apart(case: Case) -> None:
    """Raise ``ScenarioError`` for seeds, with those for training, whose drives would draw the same random numbers."""
    scenario, added = case.scenario, added_seeds(len(case.scenario.further))
    drawn = {side: added[side] for side, table in case.tables.items() if is_drawn(table)}
    check_apart((*scenario.seeds, *scenario.training_seeds), drawn)


def check_judged(scenario: Declared) -> None:
    """Raise ``ScenarioError`` where the method that is judged does not run: a page would tell of nobody."""
    if scenario.judged not in scenario.methods:
        valid, missing = ", ".join(scenario.methods), "" if scenario.localise.judged else "missing, and its default "
        raise ScenarioError(f"localise.judged: {missing}{scenario.judged!r} does not run here; valid are {valid}")


def _check(case: Case, checked: set[str]) -> None:
    """Raise for a case that cannot be run; drives ``checked`` before are not checked again, as most of a file's are."""
    scenario = case.scenario
    type_checks = checks_for(scenario)
    type_checks.check_methods(scenario)
    for expectation in case.expectations:
        for method in expectation.methods:
            if method not in scenario.methods:
                valid = ", ".join(scenario.methods)
                raise ScenarioError(f"expect: {expectation.text!r}: {method!r} does not run here; valid are {valid}")
        if expectation.seeds > len(scenario.seeds):
            there = f"{len(scenario.seeds)} seed{'s' * (len(scenario.seeds) > 1)}"
            raise ScenarioError(
                f"expect: {expectation.text!r}: the scenario has {there}; valid is 'over' so many at most"
            )
    check_judged(scenario)
    if len(set(scenario.seeds)) < len(scenario.seeds):
        raise ScenarioError(f"seeds: {list(scenario.seeds)} holds one twice; valid are seeds that differ")
    if both := sorted({*scenario.seeds} & {*scenario.training_seeds}):
        raise ScenarioError(
            f"seeds: {both} are among training_seeds {list(scenario.training_seeds)}; valid are others, on which no "
            "parameter was chosen"
        )
    check_drawn(case)
    check_drives_apart(case)
    check_chosen_elsewhere(case)
    for side in case.sides:
        with named(side):
            source = case.source(side, scenario.seeds[0])
            key = f"{side == 'query'} {source} {scenario.localise.sensors}"
            if isinstance(source, Drive) and key not in checked:
                check_drive(source, scenario.localise.sensors)
                if side != "query":
                    check_learnable(source)
                checked.add(key)
    query = case.source("query", scenario.seeds[0])
    if isinstance(scenario, Scenario) and isinstance(query, Drive):
        with named("localise.signal_faults"):
            check_signal_faults(query, scenario.localise.signal_faults, scenario.localise.sensors)
    type_checks.check(scenario, case.file, case.sources(scenario.seeds[0])[:-1])
