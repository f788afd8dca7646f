"""The Control layer as a module: it runs the behaviour that the executor orders, and commands the robot."""

from refseq.modules.heads import Parts, head_bytes
from refseq.modules.messages import (
    COMMANDS,
    HEAD,
    ORDERS,
    STATE,
    STEPS,
    Command,
    Ended,
    OrderHead,
    Step,
    head_of,
    part,
    scan_in,
)
from refseq.modules.process import Role
from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots.behaviours import BehaviourOutcome, Senses
from refseq_bench.sim.drives.behaviour_runner import RunningBehaviour, description_of
from refseq_bench.sim.modules.state import state_in

REMEMBERED = 100
"""Steps whose readings are kept: a command answers one of the last."""


class ControlModule:
    """Answers a step of the robot and the executor's order for it with a command.

    Behaviours remember what they have sensed. One that is started anew takes the steps that commands were carried out
    for, lets the behaviour of each see what it saw, and so goes on with the behaviour where it was.
    """

    role, hears, says = Role.CONTROL, (STEPS, ORDERS), COMMANDS

    def __init__(self) -> None:
        self._behaviours: RunningBehaviour | None = None
        self._scan: Scan | None = None
        self._senses: dict[int, Senses] = {}
        self._seen = -1  # the last step that the running behaviour has seen
        self._step: Step | None = None
        self._order: OrderHead | None = None

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        """Take a step or an order, and answer with the command where both are here. Raises ``RefseqError``."""
        if topic == STEPS:
            self._take(head_of(Step, parts), parts)
        else:
            self._order = head_of(OrderHead, parts)
        if self._order is None or (command := self._command(self._order)) is None:
            return None
        self._order = None
        return [(HEAD, head_bytes(command))]

    def _take(self, step: Step, parts: Parts) -> None:
        if self._step is None or self._step.drive != step.drive:
            self._behaviours = RunningBehaviour(description_of(robots.load(step.robot)))
            self._scan, self._senses, self._seen, self._step = None, {}, -1, None
        before, self._step = self._step, step
        self._scan = scan_in(parts, step.scan) or self._scan  # behaviours tell a new scan by its identity
        self._senses[step.number] = Senses(state_in(part(parts, STATE)), self._scan, step.clock)
        self._senses.pop(step.number - REMEMBERED, None)
        done = step.command
        if done is not None and done.steers and done.answers > self._seen and done.answers in self._senses:
            self._running.step(done.number, done.behaviour, self._senses[done.answers])
            self._seen = done.answers
        if before is not None and (step.held or (done is not None and done.halt)):
            self._running.halted(step.clock - before.clock)

    def _command(self, order: OrderHead) -> Command | None:
        """The command for the last step; None where the order is for another one, or the robot is held."""
        step = self._step
        if step is None or (order.drive, order.answers) != (step.drive, step.number) or step.held or step.over:
            return None
        if order.over or order.halt:
            return Command(step.drive, step.number, halt=True, over=order.over)
        if step.scan_due:
            return Command(step.drive, step.number, scan=True)
        return self._steer(order, step)

    def _steer(self, order: OrderHead, step: Step) -> Command:
        moved = self._running.step(order.number, order.behaviour, self._senses[step.number])
        self._seen = step.number
        running = moved.outcome is BehaviourOutcome.RUNNING
        ended = None if running else Ended(order.number, moved.outcome is BehaviourOutcome.FINISHED, moved.why)
        twist = moved.twist
        return Command(
            step.drive, step.number, twist.linear, twist.angular, False, order.number, order.behaviour, ended
        )

    @property
    def _running(self) -> RunningBehaviour:
        assert self._behaviours is not None, "a step came first"
        return self._behaviours
