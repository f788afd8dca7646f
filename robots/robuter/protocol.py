"""Text lines of the Robuter's serial line (card R1), parsed and formatted; each is the exact inverse of the other.

From the source: ``AM``, ``SERV OFF`` and ``ack``. All else is a choice, among it what ``AM``'s two numbers mean: the
speeds of the left and the right wheel [mm/s]. That fits Table 5.1, where ``AM a a`` goes straight on and ``AM -v -v``
back. A line is printable ASCII text, words apart by one blank, numbers without needless zeros or signs.

======================================== =========================================================================
``AM left right``                        go on with these wheel speeds
``SERV ON``, ``SERV OFF``                release or lock the motors
``ST``                                   tell the state
``ack``                                  understood: the syntax is right, and the robot is alive
``nak why``                              not understood, and why
``em cause since blocks detail``         an emergency provision that is active, since when [ms], which way it forbids
``st time left right vl vr servo bumpers provisions sonars``  the state, after one ``em`` for each of its provisions
======================================== =========================================================================

In ``st``: ``time`` [ms], counters of both encoders, their measured speeds [mm/s], ``ON`` or ``OFF``, bumpers and sonars
[mm] apart by commas or ``-`` for none, and the number of provisions.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.state import Blocked, Cause

MAX_LINE = 512
"""Longest line without its end [bytes]."""
END = b"\n"
"""Ends a line; a carriage return before it is passed over."""
MAX_TEXT = 200
"""Longest reason or detail [characters]."""
MAX_SPEED = 9999
"""Fastest wheel speed that can be asked for [mm/s]: what the robot is let is less."""
MAX_SONARS = 32
NO_ECHO = 65535
"""A sonar's reading where nothing came back, or no number."""

T = TypeVar("T")

_SPELT = str.maketrans({"°": " deg", "·": " ", "−": "-"})
_NUMBER = re.compile(r"0|-?[1-9][0-9]{0,14}")
_LARGEST = 10**15 - 1
_NONE = "-"


class ProtocolError(RobotsError):
    """A line that is none of the protocol's: the message says what is wrong with it, in one line."""


class ProtocolWord(Enum):
    """Lines without any value."""

    SERVO_ON = "SERV ON"
    SERVO_OFF = "SERV OFF"
    STATE = "ST"
    ACK = "ack"


class Servo(Enum):
    """State of the motors: they hold the wheels at a speed, or are locked."""

    ON = "ON"
    OFF = "OFF"


class Bumper(Enum):
    """A bumper by its place."""

    FRONT = "front"
    REAR = "rear"


@dataclass(frozen=True, slots=True)
class Motion:
    """Speeds asked of the left and the right wheel [mm/s]."""

    left: int
    right: int

    def __post_init__(self) -> None:
        for value in (self.left, self.right):
            _check(-MAX_SPEED <= value <= MAX_SPEED, f"wheel speed {value} mm/s: valid is -{MAX_SPEED} to {MAX_SPEED}")


@dataclass(frozen=True, slots=True)
class Refusal:
    """A line was not understood."""

    why: str

    def __post_init__(self) -> None:
        _check_text(self.why)


@dataclass(frozen=True, slots=True)
class Provision:
    """An emergency provision that is active, ``since`` when [ms]."""

    cause: Cause
    since: int
    blocks: Blocked
    detail: str

    def __post_init__(self) -> None:
        _check_size(self.since)
        _check_text(self.detail)


@dataclass(frozen=True, slots=True)
class Report:
    """The state: ``time`` [ms], encoder ``counters`` and ``speeds`` [mm/s] as (left, right), ``sonars`` [mm].

    ``provisions`` is how many are active; each has had its own line before this one.
    """

    time: int
    counters: tuple[int, int]
    speeds: tuple[int, int]
    servo: Servo
    bumpers: tuple[Bumper, ...]
    provisions: int
    sonars: tuple[int, ...]

    def __post_init__(self) -> None:
        for value in (self.time, *self.counters, *self.speeds):
            _check_size(value)
        in_order = tuple(bumper for bumper in Bumper if bumper in self.bumpers)
        _check(self.bumpers == in_order, "bumpers: valid are front and rear, in this order, once each")
        _check(0 <= self.provisions <= len(Cause), f"{self.provisions} provisions: valid is 0 to {len(Cause)}")
        _check(len(self.sonars) <= MAX_SONARS, f"{len(self.sonars)} sonars: valid are at most {MAX_SONARS}")
        # Ten reports a second of 24 readings each: no message is made before one is needed.
        for value in self.sonars:
            if not 0 <= value <= NO_ECHO:
                raise ProtocolError(f"sonar {value} mm: valid is 0 to {NO_ECHO}")


Message = ProtocolWord | Motion | Refusal | Provision | Report


def format_line(message: Message) -> bytes:
    """Return the line of a message, with its end."""
    return _text(message).encode("ascii") + END


def parse_line(line: bytes) -> Message:
    """Return the message of a line without its end; raises ``ProtocolError`` where it is none, and nothing else."""
    _check(len(line) <= MAX_LINE, f"line of more than {MAX_LINE} bytes")
    text = line.decode("latin-1")  # any byte is some character
    _check(_printable(text), "a line is printable ASCII text")
    if text in _WORDS:
        return _WORDS[text]
    verb, _, rest = text.partition(" ")
    if verb not in _PARSERS:
        raise ProtocolError(f"unknown line '{legible(text)[:40]}': valid are {', '.join((*_WORDS, *_PARSERS))}")
    return _PARSERS[verb](rest)


def legible(text: str) -> str:
    """Return any text as one that a line can carry: signs are spelt, what cannot be is a question mark; cut."""
    return "".join(c if _printable(c) else "?" for c in text.translate(_SPELT))[:MAX_TEXT]


def _printable(text: str) -> bool:
    return text.isascii() and text.isprintable()


def bounded(value: float) -> int:
    """Return the nearest whole number that a line can carry; 0 for what is no number."""
    return round(min(max(value, -_LARGEST), _LARGEST)) if value == value else 0


class LineReader:
    """Cuts a stream of bytes into lines; of one that is too long it keeps enough to be refused."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that end in ``data``, without their ends."""
        if not data:
            return []
        *whole, rest = (bytes(self._held) + data).split(END)
        self._held = bytearray(rest[: MAX_LINE + 2])
        return [line.removesuffix(b"\r")[: MAX_LINE + 1] for line in whole]

    def forget(self) -> None:
        """Drop the beginning of a line that never came to its end."""
        self._held.clear()


def _text(message: Message) -> str:
    match message:
        case ProtocolWord():
            return message.value
        case Motion(left, right):
            return f"AM {left} {right}"
        case Refusal(why):
            return f"nak {why}"
        case Provision(cause, since, blocks, detail):
            return f"em {_wired(cause)} {since} {blocks.value} {detail}"
        case Report():
            counters, speeds = (" ".join(map(str, pair)) for pair in (message.counters, message.speeds))
            bumpers = _listed(bumper.value for bumper in message.bumpers)
            end = f"{message.servo.value} {bumpers} {message.provisions} {_listed(map(str, message.sonars))}"
            return f"st {message.time} {counters} {speeds} {end}"


def _listed(words: Iterable[str]) -> str:
    return ",".join(words) or _NONE


def _unlisted(field: str) -> list[str]:
    return [] if field == _NONE else field.split(",")


def _parse_motion(rest: str) -> Motion:
    left, right = map(_number, _fields(rest, "AM", 2))
    return Motion(left, right)


def _parse_provision(rest: str) -> Provision:
    cause, since, blocks, detail = _fields(rest, "em", 4)
    return Provision(_known(_CAUSES, cause, "cause"), _number(since), _known(_BLOCKED, blocks, "direction"), detail)


def _parse_report(rest: str) -> Report:
    time, left, right, v_left, v_right, servo, bumpers, provisions, sonars = _fields(rest, "st", 9)
    return Report(
        _number(time),
        (_number(left), _number(right)),
        (_number(v_left), _number(v_right)),
        _known(_SERVOS, servo, "servo"),
        tuple(_known(_BUMPERS, name, "bumper") for name in _unlisted(bumpers)),
        _number(provisions),
        tuple(map(_number, _unlisted(sonars))),
    )


def _fields(rest: str, verb: str, count: int) -> list[str]:
    """Split what follows a verb; the last field has the blanks that are left."""
    fields = rest.split(" ", count - 1)
    _check(len(fields) == count, f"{verb} takes {count} values, not {len(fields) if rest else 0}")
    return fields


def _number(field: str) -> int:
    if not _NUMBER.fullmatch(field):
        raise ProtocolError(f"'{legible(field)[:40]}' is no whole number of up to 15 digits")
    return int(field)


def _known(table: dict[str, T], word: str, what: str) -> T:
    if word not in table:
        raise ProtocolError(f"unknown {what} '{legible(word)[:40]}': valid are {', '.join(table)}")
    return table[word]


def _wired(cause: Cause) -> str:
    return cause.value.replace(" ", "-")


def _check(holds: bool, what: str) -> None:
    if not holds:
        raise ProtocolError(what)


def _check_size(value: int) -> None:
    _check(abs(value) <= _LARGEST, f"{value} has more than 15 digits")


def _check_text(text: str) -> None:
    _check(text != "" and legible(text) == text, f"a text is 1 to {MAX_TEXT} printable ASCII characters")


_WORDS = {word.value: word for word in ProtocolWord}
_SERVOS = {servo.value: servo for servo in Servo}
_BUMPERS = {bumper.value: bumper for bumper in Bumper}
_BLOCKED = {blocked.value: blocked for blocked in Blocked}
_CAUSES = {_wired(cause): cause for cause in Cause}
_PARSERS: dict[str, Callable[[str], Message]] = {
    "AM": _parse_motion,
    "nak": Refusal,
    "em": _parse_provision,
    "st": _parse_report,
}
