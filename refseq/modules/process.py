"""The loop of a module: messages of its topics one after the other, until the robot says that the drive is over."""

import queue
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from functools import partial

from refseq.modules.link import Link
from refseq.modules.messages import STEPS, Parts, Step, head_of


class Role(StrEnum):
    """A module's part; of each but viewers there is one."""

    ROBOT = "robot"
    CONTROL = "control"
    LOCALISER = "localiser"
    MISSION = "mission"
    VIEWER = "viewer"


class ModuleProcess:
    """Messages as they come, in one thread; others come and go, and that is told.

    ``waiting`` is the number of messages that have come and are not taken yet.
    """

    def __init__(self, link: Link, role: Role, topics: Sequence[str], told: Callable[[str], None]) -> None:
        self._queue: queue.SimpleQueue[tuple[str, Parts]] = queue.SimpleQueue()
        self._told, self._role = told, role
        link.join(role)
        for topic in {*topics, STEPS}:
            link.subscribe(topic, partial(self._take, topic))
        self._topics = topics
        link.watch(self._watch)

    @property
    def waiting(self) -> int:
        """Number of messages that have come and are not taken yet."""
        return self._queue.qsize()

    def messages(self) -> Iterator[tuple[str, Parts]]:
        """The messages of the topics asked for, by topic; they end with the drive."""
        while True:
            try:
                topic, parts = self._queue.get(timeout=1.0)  # so that Ctrl-C is heard
            except queue.Empty:
                continue
            if topic in self._topics:
                yield topic, parts
            if topic == STEPS and head_of(Step, parts).over:
                return

    def _take(self, topic: str, parts: Parts) -> None:
        self._queue.put((topic, parts))

    def _watch(self, role: str, there: bool) -> None:
        if role != self._role:
            self._told(f"{role}: {'is there' if there else 'is gone'}")
