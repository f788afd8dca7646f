"""Estimate a campaign: what is kept already, and how long the rest may take."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.checks.drivable import check_route
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.campaign.run.case_tasks import tasks_of
from refseq_bench.scenarios.campaign.run.eta import in_words
from refseq_bench.scenarios.campaign.run.tasks import Question, RecordTask, Task, distinct
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.methods.names import family
from refseq_bench.scenarios.methods.plugins import is_plugin
from refseq_bench.sim.rendering.renderer import RendererKind

METRE = {
    RendererKind.FILAMENT: 0.9,
    RendererKind.BAKED: 0.3,
    RendererKind.CLASSIC: 0.35,
    RendererKind.NONE: 0.05,
}
"""Processor time of recording a metre [s]: two cameras, a view every 0.85 m, measured in the hallway."""
ASKING = {
    "thesis": 0.2,
    "counting": 0.19,
    "best": 0.12,
    "vlad": 0.06,
    "hamming": 0.2,
    "ransac": 0.4,
    "words": 0.04,
    "seqslam": 0.01,
    "odometry": 0.0,
    "lamp": 0.0,
}
"""Processor time of learning and asking a family of methods, a view [s]: of both drives together, in the hallway."""
OTHERWISE = 0.1
"""The same for a family that was not measured, a user's own localiser for one."""
SPACING = 0.85
"""Way from view to view, where that is not declared [m]."""
UNKNOWN_LENGTH = 100.0
"""Taken for the length of a recording that is not simulated [m]."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Tasks of some cases: how many recordings and sets of answers are kept, of how many, and how long the rest takes.

    ``absent`` are the reasons why some cannot be run at all. ``seconds`` of processor time are a guess, good to a
    factor of two.
    """

    recordings_kept: int
    recordings: int
    answers_kept: int
    answers: int
    seconds: float
    absent: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        """All that in a line."""
        kept = (
            f"kept: {self.recordings_kept} of {self.recordings} drives, {self.answers_kept} of {self.answers} answers"
        )
        missing = "".join(f"; skipped here: {reason}" for reason in self.absent)
        return f"{kept}; the rest: about {in_words(self.seconds)} of processor time{missing}"


def rest_of(cases: Sequence[Case], store: Store) -> Rest:
    """Count what is kept of some cases, shared tasks once, and estimate how long the rest takes."""
    asked: list[Question] = []
    absent: dict[str, None] = {}
    for case in cases:
        try:
            of_case = [task for of_seed in tasks_of(case).values() for task in of_seed]
            distinct(of_case)  # reckons the keys, for which real recordings have to be there
            asked.extend(of_case)
        except AbsentError as error:
            absent[str(error)] = None
    tasks = distinct(asked)
    kept = {task.key for task in tasks if store.has(task.key, task.ending)}
    drives, answers = (_of_kind(tasks, kind) for kind in (RecordTask, Question))
    return Rest(
        recordings_kept=sum(task.key in kept for task in drives),
        recordings=len(drives),
        answers_kept=sum(task.key in kept for task in answers),
        answers=len(answers),
        seconds=sum(_seconds(task) for task in tasks if task.key not in kept),
        absent=tuple(absent),
    )


def _of_kind(tasks: Iterable[Task], kind: type[Task]) -> list[Task]:
    return [task for task in tasks if isinstance(task, kind)]


def _seconds(task: Task) -> float:
    driving = 0.0 if task.drive is None else check_route(task.drive) * METRE[task.drive.renderer]
    if isinstance(task, RecordTask):
        return driving
    views = sum(_views(source) for source in (*task.references, task.query))
    return driving + views * sum(ASKING.get(one, OTHERWISE) for one in _families(task))


def _families(task: Question) -> set[str]:
    return {"own" if is_plugin(method) else family(method) for method in task.methods}


def _views(source: Source) -> float:
    if not isinstance(source, Drive):
        return UNKNOWN_LENGTH / SPACING
    return check_route(source) / (source.trigger.distance or SPACING)
