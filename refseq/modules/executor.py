"""The mission executor as a module: the robot's journal in, orders out."""

from collections.abc import Callable

from refseq.missions.executor import Executor, ExecutorSettings
from refseq.missions.limits import TIMEOUT
from refseq.missions.plan import Plan
from refseq.missions.status import Status
from refseq.missions.tasks import Wait
from refseq.modules.heads import MessageError, MissingError, Parts, head_bytes
from refseq.modules.messages import (
    BELIEF,
    HEAD,
    ORDERS,
    STEPS,
    Command,
    OrderHead,
    Step,
    belief_in,
    head_of,
)
from refseq.modules.process import Role


class MissionModule:
    """Runs a plan by the robot's steps, which hold all that it needs, in the order in which it happened.

    Its state is a function of the steps since the first: one that is started anew hears all of them again, and goes on
    where the one before was. ``places`` is the number of the map's places, ``timeout`` [s] what a mission may last;
    ``told`` hears each line of its log.
    """

    role, hears, says = Role.MISSION, (STEPS,), ORDERS

    def __init__(
        self,
        plan: Plan,
        places: int,
        *,
        localised: bool = True,
        timeout: float = TIMEOUT,
        told: Callable[[str], None] = lambda _line: None,
    ) -> None:
        if plan.sought is not None:
            raise MessageError(f"landmark {plan.sought.name}: no module looks for a scene; valid are ones with a place")
        for task in plan.all_tasks:
            if not isinstance(task, Wait):
                raise MessageError(f"task {task}: no module does it; valid is wait")
        self._plan, self._places, self._localised = plan, places, localised
        self._settings = ExecutorSettings(timeout=timeout)
        self._told = told
        self._begin("")

    def _begin(self, drive: str) -> None:
        self.executor = Executor(self._plan, localised=self._localised, settings=self._settings)
        self._drive, self._next, self._said = drive, 0, 0
        self._taken_at: dict[int, float] = {}  # where the odometer was at each view [m]

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        """Take the next step, and answer with the order in force; None for a step that was taken.

        Raises ``MissingError`` where one before it did not come.
        """
        step: Step = head_of(Step, parts)
        if step.drive != self._drive:
            self._begin(step.drive)
        if step.number < self._next:
            return None
        if step.number > self._next:
            raise MissingError(f"step {self._next} of the drive is missing: {step.number} came; start the module anew")
        self._next += 1
        self._take(step, parts)
        for entry in self.executor.log[self._said :]:
            self._told(str(entry))
        self._said = len(self.executor.log)
        return self._order(step)

    def _take(self, step: Step, parts: Parts) -> None:
        self._hold(step.held)
        self._carried_out(step.command)
        for touch in step.touches:
            self.executor.touched(touch)
        self.executor.move(step.time, step.travelled)
        if step.view is not None:
            self._taken_at[step.view] = step.travelled
        self._believe([data for name, data in parts if name == BELIEF], step.travelled)

    def _hold(self, held: str) -> None:
        """Pause while the robot stands for a module that is gone."""
        paused = self.executor.status is Status.PAUSED
        if held and not paused:
            self.executor.pause()
        elif not held and paused:
            self.executor.resume()

    def _carried_out(self, command: Command | None) -> None:
        # In the meantime another execution may have begun: its end is not this one's.
        if command is not None and command.ended is not None and command.ended.number == self.executor.do.number:
            self.executor.ended(command.ended.finished, command.ended.why)

    def _believe(self, beliefs: list[bytes], travelled: float) -> None:
        for data in beliefs:
            found = belief_in(data)
            if (count := len(found.belief.places)) != self._places:
                raise MessageError(f"a belief has {count} places, the map {self._places}; valid is the localiser's map")
            self.executor.believe(found.belief, travelled - self._taken_at.get(found.view, travelled))

    def _order(self, step: Step) -> Parts:
        executor, do = self.executor, self.executor.do
        head = OrderHead(
            drive=step.drive,
            answers=step.number,
            number=do.number,
            behaviour=do.behaviour,
            halt=do.halt,
            over=executor.status.value if executor.status.over else "",
            why=executor.why,
            status=executor.status.value,
            order=executor.number,
            along=executor.along,
            tasks=tuple(map(str, executor.tasks)),
            log=tuple(map(str, executor.log)),
        )
        return [(HEAD, head_bytes(head))]
