"""The mission string: landmarks in the order in which the robot meets them, each with what to do there (appendix C).

``[LD_LDMC]`` means: past the first door, and through the second. A step is a landmark and perhaps a behaviour; steps
stand in brackets with a line between. Where no behaviour is said the robot does what it did when the path was learnt.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from refseq.errors import RefseqError

TURNS = (90, 180, 270)
"""Angles by which a robot turns about itself [degrees, to the left]."""


class MissionError(RefseqError):
    """A mission that cannot be read, with the column at which it goes wrong."""


class Label(StrEnum):
    """Kinds of landmarks (C.2)."""

    DOOR = "LD"
    IMAGE = "LI"
    OBJECT = "LO"
    PLACE = "LA"


class BehaviourCode(StrEnum):
    """Behaviour from a landmark on (C.1); ``MN`` carries on with the present one.

    ``MO`` is not the thesis': its Control layer has the behaviour (5.2.1), its missions cannot say it.
    """

    SET_POINTS = "MA"
    TURN = "MT"
    ORIENT = "MO"
    FOLLOW_WALL = "MW"
    CROSS_DOOR = "MC"
    CARRY_ON = "MN"


NUMBERED = (Label.IMAGE, Label.OBJECT, Label.PLACE)
"""Landmarks of which it is said which one; a door is simply the next."""

_ANYWHERE = (BehaviourCode.CARRY_ON, BehaviourCode.SET_POINTS, BehaviourCode.TURN, BehaviourCode.ORIENT)
ADMITTED: Mapping[Label, tuple[BehaviourCode, ...]] = MappingProxyType(
    {
        Label.DOOR: (*_ANYWHERE, BehaviourCode.CROSS_DOOR),
        Label.IMAGE: _ANYWHERE,
        Label.OBJECT: _ANYWHERE,
        # The thesis names behaviours for the others only; if walls were not followed from a place on, they never were.
        Label.PLACE: (*_ANYWHERE, BehaviourCode.FOLLOW_WALL),
    }
)
"""Behaviours that are allowed at each kind of landmark."""


@dataclass(frozen=True, slots=True)
class Landmark:
    """Something that the robot recognises; ``number`` says which image, object or place it is, None for a door."""

    label: Label
    number: int | None = None

    def __str__(self) -> str:
        return f"{self.label}{'' if self.number is None else self.number}"


@dataclass(frozen=True, slots=True)
class Action:
    """A behaviour; ``turn`` [degrees, one of ``TURNS``] is None for all but ``TURN``."""

    behaviour: BehaviourCode
    turn: int | None = None

    def __str__(self) -> str:
        return f"{self.behaviour}{'' if self.turn is None else self.turn}"


@dataclass(frozen=True, slots=True)
class Step:
    """A landmark, and what to do there; None: what was done there when the path was learnt."""

    landmark: Landmark
    action: Action | None = None

    def __str__(self) -> str:
        return f"{self.landmark}{self.action or ''}"


@dataclass(frozen=True, slots=True)
class Mission:
    """Steps in their order, one at least; ``str`` writes it as ``parse_mission`` reads it."""

    steps: tuple[Step, ...]

    def __str__(self) -> str:
        return f"[{'_'.join(map(str, self.steps))}]"


def parse_mission(text: str) -> Mission:
    """Read a mission string; blanks around it and around its steps do not count.

    Raises ``MissionError`` in one line, with the column, counted from 1, and what is valid there.
    """
    reader = _MissionReader(text)
    reader.expect("[", "'[', with which a mission begins")
    steps = [reader.step()]
    while reader.next_is("_"):
        steps.append(reader.step())
    reader.expect("]", ("" if steps[-1].action else "a behaviour, ") + "'_' and another step, or ']'")
    reader.end()
    return Mission(tuple(steps))


class _MissionReader:
    """A text that is read from left to right."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def step(self) -> Step:
        """A landmark, and perhaps a behaviour."""
        label = Label(self._word(Label, "a landmark"))
        landmark = Landmark(label, self._number(label))
        begin = self._skipped()
        if self._text[begin : begin + 1] != "M":
            return Step(landmark)
        behaviour = BehaviourCode(self._word(BehaviourCode, "a behaviour"))
        if behaviour not in ADMITTED[label]:
            self._fail(begin, f"{behaviour} is not done at {label}; valid are {', '.join(ADMITTED[label])}")
        return Step(landmark, Action(behaviour, self._turn(behaviour)))

    def next_is(self, mark: str) -> bool:
        """Read a mark, if it comes next."""
        found = self._text.startswith(mark, self._skipped())
        if found:
            self._at = self._skipped() + len(mark)
        return found

    def expect(self, mark: str, valid: str) -> None:
        """Read a mark that has to come next."""
        if not self.next_is(mark):
            self._fail(self._skipped(), f"{self._found()}; valid is {valid}")

    def end(self) -> None:
        """Nothing may follow."""
        if self._skipped() < len(self._text):
            self._fail(self._skipped(), f"{self._found()} behind the mission; valid is nothing")

    def _word(self, kind: type[StrEnum], what: str) -> str:
        begin = self._skipped()
        word = self._text[begin : begin + 2]
        if word not in list(kind):
            self._fail(begin, f"{self._found()}; valid is {what}: {', '.join(kind)}")
        self._at = begin + 2
        return word

    def _number(self, label: Label) -> int | None:
        begin, digits = self._at, self._digits()
        if label in NUMBERED and not digits:
            self._fail(begin, f"{label} has no number; valid is to say which: {label}0")
        if label not in NUMBERED and digits:
            self._fail(begin, f"{label} has number {digits}; valid is none: it is the next one")
        return int(digits) if digits else None

    def _turn(self, behaviour: BehaviourCode) -> int | None:
        begin, digits = self._at, self._digits()
        if behaviour is BehaviourCode.TURN and (not digits or int(digits) not in TURNS):
            told = f"by {digits} degrees" if digits else "has no angle"
            self._fail(begin, f"{behaviour} {told}; valid are {', '.join(map(str, TURNS))}")
        if behaviour is not BehaviourCode.TURN and digits:
            self._fail(begin, f"{behaviour} has number {digits}; valid is none")
        return int(digits) if digits else None

    def _digits(self) -> str:
        found = re.compile(r"[0-9]{1,6}", re.ASCII).match(self._text, self._at)
        digits = found[0] if found else ""
        self._at += len(digits)
        return digits

    def _skipped(self) -> int:
        """Index of the next character that is no blank."""
        return next(_not_blank(self._text, self._at), len(self._text))

    def _found(self) -> str:
        begin = self._skipped()
        return f"{self._text[begin : begin + 8]!r}" if begin < len(self._text) else "the mission ends"

    def _fail(self, at: int, told: str) -> None:
        raise MissionError(f"mission {self._text!r:.60}, column {at + 1}: {told}")


def _not_blank(text: str, start: int) -> Iterator[int]:
    return (at for at in range(start, len(text)) if text[at] != " ")
