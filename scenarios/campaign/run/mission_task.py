"""The task of a mission: a method learns the references and leads a robot that is set down where the query starts."""

import math
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from functools import cached_property

import pyarrow as pa

from refseq.atlas.routes import NoRouteError
from refseq.missions import MissionError, MissionPath, Plan, as_learnt
from refseq_bench.scenarios.campaign.declare.assignment import LAMP, ODOMETRY, Assignment
from refseq_bench.scenarios.campaign.declare.outcomes import one_line
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.campaign.run.answering import cost_of, learnt_in
from refseq_bench.scenarios.campaign.run.tasks import Question, drive_with_files
from refseq_bench.scenarios.campaign.store.answers import beliefs_digest
from refseq_bench.scenarios.campaign.store.cache import DamagedError, Store
from refseq_bench.scenarios.campaign.store.keys import code_digest, key_of
from refseq_bench.scenarios.campaign.store.missions import KeptMission, read_mission, write_mission
from refseq_bench.scenarios.campaign.store.views import source_key
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.scenarios.methods.names import modules_of
from refseq_bench.scenarios.missions.leader import Journey, KnownDrives, Leader, along_reference, over_several
from refseq_bench.scenarios.missions.runs import MissionResult, refused_run, run_plan, run_program
from refseq_bench.scenarios.scoring.cost import Cost, forget_peak
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.rendering.renderer import RendererKind

BLIND = (ODOMETRY, LAMP)
"""Leaders without a camera: no image has to be drawn for them."""


@dataclass(frozen=True)
class MissionTask(Question):
    """Have one method lead the robot."""

    assignment: Assignment = field(kw_only=True)

    @property
    def method(self) -> str:
        """The method that leads."""
        (method,) = self.methods
        return method

    @cached_property
    def key(self) -> str:
        """Key of the mission: what was learnt, where it is run, what is to be done, by whom, code and packages."""
        return key_of(
            "mission",
            self.methods,
            self.plugins,
            *filter(None, [self.network]),
            *self.sources,
            self.sensors,
            self.seed,
            self.merge if self.further else None,
            self.made_by,
            repr(self.assignment),
            code_digest(__name__, *modules_of(self.methods)),
        )

    @property
    def read(self) -> tuple[Source, ...]:
        """The references."""
        return self.references

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """As of any question; for who looks at nothing all lights are one."""
        return (*super().sources[:-1], source_key(self.drive))

    @property
    def drive(self) -> Drive:
        """Where and when: the bench of the query. Who looks at nothing needs no images, and no light."""
        assert isinstance(self.query, Drive)
        if self.method in BLIND:
            return replace(self.query, renderer=RendererKind.NONE, light=Drive().light)
        return self.query

    def with_files(self, moved: Mapping[str, str]) -> "MissionTask":
        """The mission with the files that its query names where they lie on another machine; its keys stay."""
        assert isinstance(self.query, Drive)
        there = replace(self, query=drive_with_files(self.query, moved))
        there.__dict__.update(sources=self.sources, key=self.key, network=self.network)
        return there

    @property
    def kind(self) -> str:
        """Name for tasks that take about as long as this one."""
        return f"mission, {self.method}, {self.drive.renderer.value}"

    @property
    def title(self) -> str:
        """The task in words."""
        return f"mission led by {self.method}, seed {self.seed}"

    def carry_out(self, store: Store) -> None:
        """Learn and lead."""
        forget_peak()
        known = self._known(store)
        with open_bench(self.drive) as bench, ExitStack() as open_until_counted:
            leader = None
            try:
                leader = open_until_counted.enter_context(closing(self._leader(known, bench)))
                done = self._done(bench, leader, self._plan(leader.ground.way))
            except (MissionError, NoRouteError) as error:
                done = refused_run(bench, str(error), self.assignment.goal)
            cost = _cost(known, leader, done)
        kept = KeptMission(done.run, cost, beliefs_digest(done.beliefs))
        store.make(self.key, self.ending, lambda path: write_mission(path, kept))

    def _known(self, store: Store) -> KnownDrives:
        drives = self.learnt(store)
        if self.assignment.target is None:
            return KnownDrives.alone(self.method, *drives.values())
        return KnownDrives.merged(self.method, drives, self.merge)

    def _leader(self, known: KnownDrives, bench: Bench) -> Leader:
        localised = self.method not in BLIND
        target = self.assignment.target
        if target is None:
            return along_reference(self.method, known, localised=localised, seed=self.seed)
        journey = Journey(bench.pose, target.path, target.along)
        return over_several(self.method, known, journey, localised=localised, seed=self.seed)

    def _plan(self, way: MissionPath) -> Plan:
        asked = self.assignment.asked
        return as_learnt(way) if asked is None else asked.for_way(way)

    def _done(self, bench: Bench, leader: Leader, plan: Plan) -> MissionResult:
        assignment, drive = self.assignment, self.drive
        if self.method == LAMP:
            return run_program(bench, leader.ground, plan, assignment.goal, stages=assignment.stages, drive=drive)
        return run_plan(bench, leader, plan, lambda _: assignment.goal, sensors=self.sensors, drive=drive)


def _cost(known: KnownDrives, leader: Leader | None, done: MissionResult) -> Cost:
    """Cost of the maps and of a leader, None where there is no way to lead; opening the bench is no method's."""
    guest = leader and leader.guest
    return cost_of(
        known.drives,
        (*known.map.sequences, leader and leader.localiser),
        learn_s=learnt_in(known.maps, [known.merging]) + (leader.learn_s if leader else 0.0),
        answer_s=math.fsum(belief.timings.total for belief in done.beliefs),
        features=None,
        guests=[guest] if guest else [],
    )


def mission_of(task: MissionTask, store: Store) -> KeptMission:
    """Read what a task that is done left in the store. Raises ``DamagedError``."""
    path = store.path(task.key, task.ending)
    try:
        return read_mission(path)
    except (OSError, pa.ArrowException, ValueError, KeyError, TypeError) as error:
        raise DamagedError(task.key, f"{path}: is no mission: {one_line(error)}") from error
