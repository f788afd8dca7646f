"""Tasks of a case: what is asked of its methods, for each of its seeds."""

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from refseq_bench.scenarios.campaign.declare.assignment import Assignment
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.checks.missions import asked_mission, program_of, target_of
from refseq_bench.scenarios.campaign.declare.schema import MissionScenario, Scenario
from refseq_bench.scenarios.campaign.run.mission_task import MissionTask
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, Question
from refseq_bench.scenarios.methods.names import family
from refseq_bench.scenarios.methods.shelf import Learning

Asked = TypeVar("Asked", bound=Question)


def tasks_of(case: Case) -> dict[int, list[Question]]:
    """The questions of a case by seed. Raises ``AbsentError``."""
    tasks = mission_tasks(case) if isinstance(case.scenario, MissionScenario) else answer_tasks(case)
    return {seed: list(of_seed) for seed, of_seed in tasks.items()}


def answer_tasks(case: Case) -> dict[int, list[AnswerTask]]:
    """The questions of a case of localising by seed, a task for each family of methods. Raises ``AbsentError``."""
    families: dict[str, list[str]] = {}
    for method in case.scenario.methods:
        families.setdefault(family(method), []).append(method)
    scenario = case.scenario
    faults = scenario.localise.signal_faults if isinstance(scenario, Scenario) else ()
    make = partial(AnswerTask, signal_faults=faults)
    return {seed: [_asked(make, case, seed, *methods) for methods in families.values()] for seed in case.scenario.seeds}


def mission_tasks(case: Case) -> dict[int, list[MissionTask]]:
    """The missions of a case by seed, one a method."""
    make = partial(MissionTask, assignment=assignment_of(case))
    return {
        seed: [_asked(make, case, seed, method) for method in case.scenario.methods] for seed in case.scenario.seeds
    }


def _asked(make: Callable[..., Asked], case: Case, seed: int, *methods: str) -> Asked:
    reference, *further, query = case.sources(seed)
    scenario = case.scenario
    return make(
        methods=methods,
        reference=reference,
        query=query,
        places=scenario.places,
        sensors=scenario.localise.sensors,
        seed=seed,
        limit=scenario.limits.seconds,
        further=tuple(further),
        merge=scenario.localise.merge,
        made_by=Learning(**scenario.localise.learn.model_dump()),
    )


def assignment_of(case: Case) -> Assignment:
    """The assignment of a case of missions."""
    scenario = case.scenario
    assert isinstance(scenario, MissionScenario)
    table = scenario.mission
    return Assignment(asked_mission(table, case.file), target_of(table), program_of(table, case.file), table.goal)
