"""The Control layer as a module: it runs the behaviour that the executor orders, and commands the robot."""

from collections.abc import Callable
from dataclasses import replace

from refseq.modules.heads import head_bytes
from refseq.modules.link import Link
from refseq.modules.messages import (
    COMMANDS,
    HEAD,
    ORDERS,
    STATE,
    STEPS,
    Command,
    Ended,
    OrderHead,
    Parts,
    Step,
    head_of,
    part,
    scan_in,
)
from refseq.modules.process import ModuleProcess, Role
from refseq_bench import robots
from refseq_bench.robots.behaviours import Behaviour, BehaviourOutcome, RobotDescription, Senses
from refseq_bench.sim.drives.behaviour_runner import behaviour_in, description_of
from refseq_bench.sim.missions.mission import AT_REST
from refseq_bench.sim.modules.state import state_in

REMEMBERED = 100
"""Steps whose readings are kept: a command answers one of the last."""


class ControlModule:
    """Answers a step of the robot and the executor's order for it with a command.

    Behaviours remember what they have sensed. One that is started anew takes the steps that commands were carried out
    for, lets the behaviour of each see what it saw, and so goes on with the behaviour where it was.
    """

    def __init__(self) -> None:
        self._description: RobotDescription | None = None
        self._running: tuple[int, Behaviour] | None = None
        self._senses: dict[int, Senses] = {}
        self._seen = -1  # the last step that the running behaviour has seen
        self._step: Step | None = None

    def take(self, parts: Parts) -> None:
        """Take the next step. Raises ``RefseqError`` for what is none."""
        step: Step = head_of(Step, parts)
        if self._step is None or self._step.drive != step.drive:
            self._description = description_of(robots.load(step.robot))
            self._running, self._senses, self._seen = None, {}, -1
        self._step = step
        scan = scan_in(parts, step.scan)
        self._senses[step.number] = Senses(state_in(part(parts, STATE)), scan, step.clock)
        self._senses.pop(step.number - REMEMBERED, None)
        done = step.command
        if done is not None and done.steers and done.answers > self._seen and done.answers in self._senses:
            self._behaviour(done.number, done.behaviour).step(self._senses[done.answers])
            self._seen = done.answers

    def answer(self, order: OrderHead) -> Command | None:
        """The command for the last step; None where the order is for another one, or the robot is held."""
        step = self._step
        if step is None or (order.drive, order.answers) != (step.drive, step.number) or step.held or step.over:
            return None
        senses, command = self._senses[step.number], Command(step.number, halt=True, over=order.over)
        if order.over:
            return command
        if order.photograph and abs(senses.state.twist.linear) < AT_REST:
            return replace(command, photograph=order.photograph)
        if order.halt:
            return command
        if senses.scan is None:
            return replace(command, scan=True)
        return self._steer(order, senses, step.number)

    def _steer(self, order: OrderHead, senses: Senses, number: int) -> Command:
        moved = self._behaviour(order.number, order.behaviour).step(senses)
        self._seen = number
        running = moved.outcome is BehaviourOutcome.RUNNING
        ended = None if running else Ended(order.number, moved.outcome is BehaviourOutcome.FINISHED, moved.why)
        twist = moved.twist
        return Command(number, twist.linear, twist.angular, False, order.number, order.behaviour, ended)

    def _behaviour(self, number: int, words: str) -> Behaviour:
        """The behaviour that is running, or another one where that was asked for."""
        assert self._description is not None, "a step came first"
        if self._running is None or self._running[0] != number:
            self._running = number, behaviour_in(words, self._description)
        return self._running[1]


def run_control(link: Link, told: Callable[[str], None]) -> None:
    """Command the robot until the drive is over."""
    module, publish = ControlModule(), link.publisher(COMMANDS)
    order: OrderHead | None = None
    for topic, parts in ModuleProcess(link, Role.CONTROL, (STEPS, ORDERS), told).messages():
        if topic == STEPS:
            module.take(parts)
        else:
            order = head_of(OrderHead, parts)
        # An order may be here before the step that it answers.
        if order is not None and (command := module.answer(order)) is not None:
            publish([(HEAD, head_bytes(command))])
            order = None
