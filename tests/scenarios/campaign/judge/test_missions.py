"""Judging missions of which some were not run to the end; the missions are made up, no robot drives."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import pytest

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import find
from refseq_bench.scenarios.campaign.declare.expectations import parse
from refseq_bench.scenarios.campaign.declare.mission_figures import MISSION_FIGURES
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.judge import missions
from refseq_bench.scenarios.campaign.judge.missions import JudgedMissions, judged_missions
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.missions import KeptMission
from refseq_bench.scenarios.campaign.store.result_file import JudgementRecord
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.missions import MissionRun

SEEDS = (1, 2, 3, 4, 5)
COST = Cost(learn_s=0.0, answer_s=0.0, places=1, bytes_kept=0, features=None, peak_bytes=0)


@dataclass(frozen=True)
class Led:
    """A task of a mission, as judging sees it, and whether the robot ended at the goal."""

    key: str
    method: str
    arrived: bool


def kept(task: Led, _: Store) -> KeptMission:
    end = 0.0 if task.arrived else 9.0
    track = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [1.0, end, 0.0, 0.0, 0.0]])
    run = MissionRun(task.arrived, "", track, (), (), (), goal=(0.0, 0.0), way=1.0, ideal=1.0, optimal=1.0)
    return KeptMission(run, COST, "")


def judged(monkeypatch: pytest.MonkeyPatch, ran: Mapping[str, Mapping[int, bool]], *texts: str) -> JudgedMissions:
    """The second door by methods that arrive at some seeds, as told, and broke at all others."""
    declared = find(["second-door"], runnable=False)[0]
    expectations = tuple(parse(text, None, MISSION_FIGURES) for text in texts)
    case: Case = replace(declared, expectations=expectations)
    tasks = {
        seed: [Led(f"{m} {seed}", m, of_method.get(seed, False)) for m, of_method in ran.items()] for seed in SEEDS
    }
    broke = TaskOutcome(Verdict.ERROR, "worker killed")
    outcomes = {
        task.key: TaskOutcome(Verdict.PASSED) if seed in ran[task.method] else broke
        for seed, of_seed in tasks.items()
        for task in of_seed
    }
    monkeypatch.setattr(missions, "mission_of", kept)
    return judged_missions(case, cast(Any, tasks), outcomes, cast(Store, None))


def told(record: JudgementRecord) -> tuple[bool | None, float | None, float | None]:
    return record.met, record.value, record.bound


def test_methods_are_compared_over_the_seeds_that_both_ran(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fifth seed is too hard for either; a worker broke before one of them failed there."""
    ran = {"odometry": dict.fromkeys(SEEDS[:3], True), "best/chain": {seed: seed != 5 for seed in SEEDS}}
    found = judged(
        monkeypatch,
        ran,
        "completed of best/chain >= 95 % over 5 seeds",
        "completed of best/chain >= completed of odometry",
        "completed of best/chain >= completed of odometry over 4 seeds",
    )
    alone, both, too_few = found.judgements
    assert told(alone) == (False, 0.8, 0.95)
    assert told(both) == (True, 1.0, 1.0)
    assert (too_few.met, too_few.reason) == (None, "3 seeds of the 4 that it asks for were run")
    assert found.verdict is Verdict.ERROR
    assert [len(one.scores) for one in found.missions] == [3, 5]


def test_methods_without_a_seed_in_common_are_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    ran = {"odometry": {1: True}, "best/chain": {2: True}}
    (both,) = judged(monkeypatch, ran, "completed of best/chain >= completed of odometry").judgements
    assert (both.met, both.reason) == (None, "no seed was run to its end")


def test_a_method_that_never_ran_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    ran = {"odometry": {1: True}, "best/chain": {1: True}}
    texts = ("completed of thesis/chain >= completed of odometry", "completed of thesis/chain > 0")
    found = judged(monkeypatch, ran, *texts)
    assert [(one.met, one.reason) for one in found.judgements] == [(None, "thesis/chain has no answers")] * 2
