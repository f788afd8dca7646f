"""The localiser as a module: views in, beliefs out, numbered as the views are."""

from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.modules.heads import MissingError, Parts, head_bytes
from refseq.modules.messages import (
    BELIEF,
    BELIEFS,
    HEAD,
    VIEWS,
    BeliefHead,
    ViewHead,
    head_of,
    view_in,
)
from refseq.modules.process import Role
from refseq.serve.answers import answer_to

ASKED = 3
"""So often the first views of a drive are asked for again: those that do not come then are kept no more."""


class LocaliserModule:
    """Answers views in their order; another drive begins anew.

    One that is started anew hears all views of the drive again, those that the robot keeps: its state, and so each
    belief, is then what it would have been. In a drive of more it begins with the first that is kept.
    """

    role, hears, says = Role.LOCALISER, (VIEWS,), BELIEFS

    def __init__(self, map_: Map) -> None:
        self._map, self._localiser = map_, Localiser(map_)
        self._begin("")

    def _begin(self, drive: str) -> None:
        self._localiser.reset()
        self._drive, self._next, self._asked = drive, 0, 0

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        """Answer a view; None for one that was answered.

        Raises ``RefseqError`` for what is none, and ``MissingError`` where one before it did not come.
        """
        head: ViewHead = head_of(ViewHead, parts)
        if head.drive != self._drive:
            self._begin(head.drive)
        if head.number < self._next:
            return None
        if head.number > self._next and (self._next or self._asked < ASKED):
            self._asked += 1
            raise MissingError(f"view {self._next} of the drive is missing: {head.number} came")
        self._next = head.number + 1
        view = view_in(head, parts)
        answer = answer_to(self._map, head.number, view, self._localiser.update(view))
        return [(HEAD, head_bytes(BeliefHead(head.drive, head.number))), (BELIEF, answer.json)]
