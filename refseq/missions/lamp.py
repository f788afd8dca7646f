"""LAMP, the older language (Fig. 1.6): a program of stages, each ended by what the odometer or one sonar reads.

A stage is a line: a verb, and words that each have a number. It knows nothing of where the robot is, only of obstacles
beside it, which is what later methods are compared with. Scanner noise apart, the thesis' eleven lines are read as they
are printed; which side ``PS`` 1 and 2 are is not told there, here they are left and right.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from refseq.missions.language import MissionError


class Verb(StrEnum):
    """Verb of a stage: beside an obstacle, straight or turning, or through the next narrow opening."""

    BESIDE = "MOVP"
    MOVE = "MOVE"
    CROSS = "CROSS"


class LampWord(StrEnum):
    """Meaning of a stage's number."""

    SPEED_BESIDE = "MV"
    SIDE = "PS"
    RANGE = "USL"
    SONAR = "SEN"
    SPEED = "LV"
    TURN_RATE = "AV"
    ANGLE = "ANL"
    DISTANCE = "DIL"


@dataclass(frozen=True, slots=True)
class Meaning:
    """A word's unit as it is written, and the least and greatest number that makes sense."""

    unit: str
    low: int
    high: int


WORDS: Mapping[LampWord, Meaning] = MappingProxyType(
    {
        LampWord.SPEED_BESIDE: Meaning("mm/s", 1, 1000),
        LampWord.SIDE: Meaning("1 left, 2 right", 1, 2),
        LampWord.RANGE: Meaning("mm", 1, 5000),
        LampWord.SONAR: Meaning("number of a sonar", 0, 23),
        LampWord.SPEED: Meaning("mm/s", -1000, 1000),
        LampWord.TURN_RATE: Meaning("degrees/s", 1, 180),
        LampWord.ANGLE: Meaning("degrees, to the left", -360, 360),
        LampWord.DISTANCE: Meaning("mm", 1, 100_000),
    }
)
"""Meaning and bounds of each word; the bounds are ours."""

TAKES: Mapping[Verb, tuple[LampWord, ...]] = MappingProxyType(
    {
        Verb.BESIDE: (LampWord.SPEED_BESIDE, LampWord.SIDE, LampWord.RANGE, LampWord.SONAR),
        Verb.MOVE: (
            LampWord.SPEED,
            LampWord.TURN_RATE,
            LampWord.ANGLE,
            LampWord.DISTANCE,
            LampWord.RANGE,
            LampWord.SONAR,
        ),
        Verb.CROSS: (),
    }
)
"""Words that a verb may have."""

ENDS = (LampWord.ANGLE, LampWord.DISTANCE, LampWord.RANGE)
"""Words that end a stage; a ``MOVE`` has one of them."""


@dataclass(frozen=True)
class LampStage:
    """A line of the program: its verb, and its numbers by word, in the units of ``WORDS``."""

    verb: Verb
    numbers: Mapping[LampWord, int]

    def __str__(self) -> str:
        return " ".join([self.verb, *(f"{word} {number}" for word, number in self.numbers.items())])


def parse_lamp(text: str) -> tuple[LampStage, ...]:
    """Read a program; lines may be numbered, and empty ones do not count.

    Raises ``MissionError`` in one line, with line and column, counted from 1, and what is valid there.
    """
    lines = [(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip()]
    if not lines:
        raise MissionError("LAMP program: holds no line; valid is one stage a line: MOVE, MOVP or CROSS")
    return tuple(_LampLine(number, line).stage() for number, line in lines)


def print_lamp(stages: tuple[LampStage, ...]) -> str:
    """The program as ``parse_lamp`` reads it, its lines numbered."""
    return "".join(f"{number}. {stage}\n" for number, stage in enumerate(stages, 1))


class _LampLine:
    """One line and its words, each with the column at which it begins."""

    def __init__(self, number: int, text: str) -> None:
        self._number, self._text = number, text.rstrip()
        numbered = re.match(r"\s*[0-9]+\.", text, re.ASCII)
        begin = numbered.end() if numbered else 0
        self._words = [(found[0], found.start()) for found in re.compile(r"\S+").finditer(text, begin)]

    def stage(self) -> LampStage:
        """The line as a stage."""
        if not self._words:
            self._fail(len(self._text), f"no verb; valid are {', '.join(Verb)}")
        (name, at), *rest = self._words
        if name not in list(Verb):
            self._fail(at, f"{name!r:.20} is no verb; valid are {', '.join(Verb)}")
        verb = Verb(name)
        stage = LampStage(verb, self._numbers(verb, rest))
        if missing := _missing(stage):
            self._fail(len(self._text), f"{verb} without {missing}")
        return stage

    def _numbers(self, verb: Verb, words: list[tuple[str, int]]) -> dict[LampWord, int]:
        found: dict[LampWord, int] = {}
        for (name, at), value in zip(words[::2], [*words[1::2], None], strict=False):
            if name not in TAKES[verb]:
                valid = ", ".join(TAKES[verb]) or "nothing"
                self._fail(at, f"{name!r:.20} behind {verb}; valid is {valid}")
            word = LampWord(name)
            if word in found:
                self._fail(at, f"{word} is there twice; valid is once")
            text, at = value or ("", len(self._text))
            found[word] = self._value(word, text, at)
        return found

    def _value(self, word: LampWord, text: str, at: int) -> int:
        meaning = WORDS[word]
        right = re.fullmatch(r"[-+]?[0-9]{1,7}", text, re.ASCII)
        if not right or not meaning.low <= int(text) <= meaning.high:
            given = repr(text)[:20] if text else "nothing"
            self._fail(at, f"{word} has {given}; valid is {meaning.low} to {meaning.high} ({meaning.unit})")
        return int(text)

    def _fail(self, at: int, told: str) -> None:
        raise MissionError(f"LAMP program, line {self._number}, column {at + 1}: {told}")


def _missing(stage: LampStage) -> str:
    """The word that a stage lacks, and what is valid; nothing of a whole one."""
    has = stage.numbers
    if stage.verb is Verb.BESIDE:
        lacking = [word for word in (LampWord.SPEED_BESIDE, LampWord.RANGE, LampWord.SONAR) if word not in has]
        return f"{lacking[0]}; valid is MV, USL and SEN" if lacking else ""
    if stage.verb is Verb.CROSS:
        return ""
    if sum(word in has for word in ENDS) != 1:
        return "one end; valid is one of ANL, DIL and USL"
    if (LampWord.RANGE in has) != (LampWord.SONAR in has):
        return "its other half; valid are USL and SEN together"
    turns = LampWord.ANGLE in has
    if turns and LampWord.TURN_RATE not in has:
        return "AV; valid is how fast it turns to ANL"
    if not turns and not has.get(LampWord.SPEED):
        return "LV; valid is how fast it goes, not 0"
    return ""
