"""The loop of a module: what it hears, one message after the other, and what it answers, until the drive is over."""

import queue
import time
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from typing import Protocol

from refseq.modules.heads import MissingError, Parts
from refseq.modules.link import AGAIN, Link, Publish
from refseq.modules.messages import STEPS, Step, head_of

TRIES = 10
"""So often a module asks for what is kept, with nothing new among it.

On a busy machine a new message may come before the older ones.
"""


class Role(StrEnum):
    """A module's part; of each but viewers there is one."""

    ROBOT = "robot"
    CONTROL = "control"
    LOCALISER = "localiser"
    MISSION = "mission"
    VIEWER = "viewer"


class Module(Protocol):
    """A part of the robot: it hears topics, and answers on one; empty: on none.

    Its state follows from what it has heard of a drive. One that is started anew hears the robot's steps and views
    again, and is then where the one before was.
    """

    @property
    def role(self) -> Role:
        """The module's part."""

    @property
    def hears(self) -> tuple[str, ...]:
        """Topics that it takes."""

    @property
    def says(self) -> str:
        """Topic that it answers on."""

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        """Take a message, and answer it; None: with nothing. Raises ``RefseqError`` for what is none.

        ``MissingError`` asks to hear all again that is kept, from before what came.
        """


def run_module(link: Link, module: Module, told: Callable[[str], None]) -> None:
    """Run a module until the robot says that the drive is over; others come and go, and that is told."""
    link.join(module.role)
    answer = link.publisher(module.says) if module.says else None
    ear = _Ear(link, module)
    link.watch(partial(_tell, told, module.role))
    tries = 0
    while True:
        try:
            _follow(ear, module, answer)
        except MissingError:
            tries = 1 if ear.answered else tries + 1
            if tries == TRIES:
                raise
            time.sleep(AGAIN)
        else:
            return
        finally:
            ear.close()
        ear = _Ear(link, module)


class _Ear:
    """All that a module hears, from what was kept on, until it is closed.

    ``answered`` is true once something of it was new to the module.
    """

    def __init__(self, link: Link, module: Module) -> None:
        self.heard: queue.SimpleQueue[tuple[str, Parts]] = queue.SimpleQueue()
        self.answered = False
        topics = dict.fromkeys((*module.hears, STEPS))
        self._ends = [link.subscribe(topic, partial(self._put, topic)) for topic in topics]

    def _put(self, topic: str, parts: Parts) -> None:
        self.heard.put((topic, parts))

    def close(self) -> None:
        """Hear no more."""
        for end in self._ends:
            end()


def _follow(ear: _Ear, module: Module, answer: Publish | None) -> None:
    """Have a module answer what it hears, until the drive is over."""
    over = False
    while not over:
        try:
            topic, parts = ear.heard.get(timeout=1.0)  # so that Ctrl-C is heard
        except queue.Empty:
            continue
        said = module.hear(topic, parts) if topic in module.hears else None
        ear.answered |= said is not None
        if said is not None and answer is not None:
            answer(said)
        over = topic == STEPS and bool(head_of(Step, parts).over)


def _tell(told: Callable[[str], None], own: str, role: str, there: bool) -> None:
    if role != own:
        told(f"{role}: {'is there' if there else 'is gone'}")
