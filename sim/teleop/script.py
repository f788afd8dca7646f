"""Scripts of commands: one line a time, such as ``2.0 forward`` or ``6 sample``, in the order of time.

A line is a time [s, simulated] and the commands from then on. Motions hold until the next line with a motion, and
those of one line go together, ``forward 0.3 left 0.2`` is a bend: ``forward``, ``back`` with a speed [m/s] or the usual
one, ``left``, ``right`` with a rate [rad/s], ``halt``, and ``away``, which leaves the controls. Buttons are those of
``commands.Button``. Sampling begins with the script unless it says ``start`` somewhere; it ends with ``stop`` or
``abort``. A ``#`` begins a comment.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from refseq_bench.robots import Twist
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.commands import (
    AFTER,
    SPEED,
    TURN_RATE,
    Button,
    Commands,
    CommandSource,
    SessionPhase,
    SessionStatus,
    valid_in,
)

AWAY: Literal["away"] = "away"
HALT = "halt"
AXES = {"forward": ("ahead", 1), "back": ("ahead", -1), "left": ("turn", 1), "right": ("turn", -1)}
USUAL = {"ahead": SPEED, "turn": TURN_RATE}
WORDS = (*AXES, HALT, AWAY, *Button)
MOST = 10.0
"""The highest speed or rate of a motion [m/s, rad/s]: no robot is so fast."""
LEAST = 1e-9
LATEST = 1e6
"""A line's time at most [s], more than eleven days; a choice."""
SOON = 1e-6
"""Tolerance of a line's time [s]: logged times are rounded."""


@dataclass(frozen=True, slots=True)
class TimedCommand:
    """Commands from ``time`` [s] on: a ``motion``, or None, the one before; and ``buttons`` at that time."""

    time: float
    motion: Twist | Literal["away"] | None = None
    buttons: tuple[Button, ...] = ()


def parse(text: str, name: str = "script") -> tuple[TimedCommand, ...]:
    """Read a script. Raises ``SimError`` with line, column, the value and what is valid."""
    lines = [_words(line, f"{name}, line {number}") for number, line in enumerate(text.splitlines(), 1)]
    lines = [words for words in lines if words]
    starts = any(word.text == Button.START for words in lines for word in words)
    phase, script = SessionPhase.READY if starts else SessionPhase.SAMPLING, list[TimedCommand]()
    for first, *words in lines:
        if phase.over:
            raise first.error("comes after the end; valid is nothing after stop or abort")
        script.append(_command(first, words, script[-1].time if script else 0.0))
        phase = _followed(words, phase)
    if not phase.over:
        raise SimError(f"{name}: it does not end; valid is a last line such as '30 stop'")
    return tuple(script)


def printed(script: Sequence[TimedCommand]) -> str:
    """Write a script as text; ``parse`` reads it back unchanged."""
    return "".join(" ".join((_shown(one.time), *_motion_words(one.motion), *one.buttons)) + "\n" for one in script)


class ScriptSource:
    """The commands of a script, each at the first control period that is not before its time."""

    def __init__(self, script: Sequence[TimedCommand]) -> None:
        self._left = list(script)
        self._twist: Twist | None = Twist()
        self._starts = not any(Button.START in line.buttons for line in script)

    def commands(self, status: SessionStatus) -> Commands:
        """Return the commands of this control period."""
        buttons = [Button.START] if self._starts else []
        self._starts = False
        while self._left and self._left[0].time <= status.time + SOON:
            line = self._left.pop(0)
            buttons += line.buttons
            if line.motion is not None:
                self._twist = None if line.motion == AWAY else line.motion
        return Commands(self._twist, tuple(buttons))


class CommandLog:
    """Passes on the commands of another source and keeps them as a script, ``script``."""

    def __init__(self, source: CommandSource) -> None:
        self._source = source
        self._twist: Twist | None = Twist()
        self.script: list[TimedCommand] = []

    def commands(self, status: SessionStatus) -> Commands:
        """Return the other source's commands of this control period."""
        commands, phase = self._source.commands(status), status.phase
        if phase.over:
            return commands
        buttons = []
        for button in commands.buttons:
            if (phase, button) in AFTER:  # one that does nothing would be a mistake in a script
                buttons.append(button)
                phase = AFTER[phase, button]
        motion = None if commands.twist == self._twist else commands.twist or AWAY
        if motion is not None or buttons:
            self.script.append(TimedCommand(round(status.time, 6), motion, tuple(buttons)))
        self._twist = commands.twist
        return commands


@dataclass(frozen=True, slots=True)
class _Word:
    """A word and its place in the script."""

    text: str
    place: str

    def error(self, why: str) -> SimError:
        return SimError(f"{self.place}: '{self.text}' {why}")

    @property
    def numeric(self) -> bool:
        """True for what begins like a number."""
        return re.match(r"[-+.\d]", self.text) is not None

    def number(self, valid: str, most: float, least: float = 0.0) -> float:
        """Parse the number; raises ``SimError`` unless it lies from ``least`` to ``most``."""
        try:
            value = float(self.text.replace("_", "x"))  # Python takes 1_5 for 15
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise self.error(f"is not valid; {valid}")
        return value


def _words(line: str, place: str) -> list[_Word]:
    code = line.partition("#")[0]
    return [_Word(match[0], f"{place}, column {match.start() + 1}") for match in re.finditer(r"\S+", code)]


def _command(first: _Word, words: Sequence[_Word], after: float) -> TimedCommand:
    valid = f"valid is a time [s] from {_shown(after)}, that of the line before, to {_shown(LATEST)}"
    time = first.number(valid, LATEST, after)
    if not words:
        raise first.error("is alone on its line; valid is a time and what is asked for then, such as '2 forward'")
    for word in words:
        if not word.numeric and word.text not in WORDS:
            raise word.error(f"is not valid; valid are {', '.join(WORDS)}")
    return TimedCommand(time, _motion(words), tuple(Button(word.text) for word in words if word.text in set(Button)))


def _paired(words: Sequence[_Word]) -> list[tuple[_Word, _Word | None]]:
    """Pair each word with the number after it; raises ``SimError`` for a number elsewhere."""
    pairs: list[tuple[_Word, _Word | None]] = []
    for word in words:
        if not word.numeric:
            pairs.append((word, None))
        elif pairs and pairs[-1][0].text in AXES and pairs[-1][1] is None:
            pairs[-1] = pairs[-1][0], word
        else:
            raise word.error("is not valid; valid is a number after forward, back, left or right")
    return pairs


def _motion(words: Sequence[_Word]) -> Twist | Literal["away"] | None:
    """The motion of a line."""
    moves = [(word, number) for word, number in _paired(words) if word.text in (*AXES, HALT, AWAY)]
    if not moves:
        return None
    if any(word.text in (HALT, AWAY) for word, _ in moves):
        if len(moves) > 1:
            raise moves[1][0].error("does not go with the motion before it; valid is halt or away alone")
        return AWAY if moves[0][0].text == AWAY else Twist()
    asked: dict[str, float] = {}
    for word, number in moves:
        axis, sign = AXES[word.text]
        if axis in asked:
            raise word.error("is the second motion along its axis; valid is one a line")
        valid = f"valid is a number above 0, up to {_shown(MOST)}"
        asked[axis] = sign * (USUAL[axis] if number is None else number.number(valid, MOST, LEAST))
    return Twist(asked.get("ahead", 0.0), asked.get("turn", 0.0))


def _followed(words: Sequence[_Word], phase: SessionPhase) -> SessionPhase:
    """The phase after a line; raises ``SimError`` for a button that does nothing in it."""
    for word in words:
        if word.text not in set(Button):
            continue
        after = AFTER.get((phase, Button(word.text)))
        if after is None:
            valid = f"valid are {', '.join(valid_in(phase))}" if valid_in(phase) else "it is over"
            raise word.error(f"does nothing while {phase}; {valid}")
        phase = after
    return phase


def _motion_words(motion: Twist | Literal["away"] | None) -> list[str]:
    if motion is None:
        return []
    if motion == AWAY:
        return [AWAY]
    if motion == Twist():
        return [HALT]
    told = []
    for axis, value in (("ahead", motion.linear), ("turn", motion.angular)):
        name = next(name for name, (of, sign) in AXES.items() if of == axis and sign * value >= 0)
        if value:
            told += [name] if abs(value) == USUAL[axis] else [name, _shown(abs(value))]
    return told


def _shown(value: float) -> str:
    return repr(float(value)).removesuffix(".0")
