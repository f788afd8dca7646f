"""A campaign without a simulator: drives made by rule, as logs in a folder of real recordings; all else is real."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from refseq.logs import RecordingWriter
from refseq.planar import Pose
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome
from refseq_bench.scenarios.campaign.judge.drives import Judged, judged
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.campaign.run.tasks import distinct, perform
from refseq_bench.scenarios.campaign.store.cache import Store
from tests.support import corridor_drive

SCENARIO = """
title = "Made <by> rule & kept"
source = "nowhere"
{top}
seeds = [1, 2]
expect = [{expect}]
[reference]
log = "reference.mcap"
odometry_noise = true
[query]
log = "query.mcap"
[localise]
methods = {methods}
sensors = ["forward", "laser"]
{rest}
"""
EXPECT = '"success >= 0 %", "ece of vlad <= 0.0", "lost_auroc >= 0.5"'


def write_logs(folder: Path, count: int = 12) -> None:
    """Two drives along the same corridor, the later one darker; its last views are beside the path."""
    rng = np.random.default_rng(0)
    for name, brightness in (("reference", 1.0), ("query", 0.5)):
        views = corridor_drive(rng, count, brightness=brightness, size=120)
        if name == "query":
            off = [replace(v, truth=Pose(v.truth.x, v.truth.y + 5, v.truth.heading)) for v in views[-3:] if v.truth]
            views = [*views[:-3], *off]
        fault = '[{"kind": "camera-black", "camera": "forward", "at": 3.0, "until": 6.0}]'
        metadata = {"world": "made", "light": name, "seed": "7", **({"faults": fault} if name == "query" else {})}
        with RecordingWriter(folder / f"{name}.mcap", metadata) as writer:
            for view in views:
                assert view.truth is not None
                writer.write(view, view.truth)


def made_cases(
    folder: Path, name: str = "made", *, top: str = "", expect: str = EXPECT, methods: str = '["thesis", "vlad"]',
    rest: str = "",
) -> list[Case]:  # fmt: skip
    """The cases of a scenario file that is written there."""
    path = folder / f"{name}.toml"
    path.write_text(SCENARIO.format(top=top, expect=expect, methods=methods, rest=rest))
    return load(path)


def carried_out(case: Case, store: Store) -> Judged:
    """Do all that a case asks for, in this process, and judge it."""
    tasks = answer_tasks(case)
    outcomes: dict[str, TaskOutcome] = {}
    for task in distinct([task for of_seed in tasks.values() for task in of_seed]):
        outcomes[task.key] = perform(task, store)
    return judged(case, tasks, outcomes, store)
