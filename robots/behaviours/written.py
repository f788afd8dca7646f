"""Behaviours as they are written: ``MA:3,0,90``, ``MT:-180``, ``MW:left,0.6``, ``MC``, ``MN:2.5``, ``stop``."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from refseq_bench.robots.behaviours.behaviour import Behaviour, RobotDescription
from refseq_bench.robots.behaviours.carry_on import CarryOn
from refseq_bench.robots.behaviours.cross_door import CrossDoor, CrossingSide
from refseq_bench.robots.behaviours.follow_wall import FIRST_REACH, FollowWall, closest
from refseq_bench.robots.behaviours.halt import Halt
from refseq_bench.robots.behaviours.orient import Orient
from refseq_bench.robots.behaviours.sensing.doorway import DoorFinder
from refseq_bench.robots.behaviours.sensing.wall import WallSide
from refseq_bench.robots.behaviours.set_point import SetPoint
from refseq_bench.robots.behaviours.turn import Turn
from refseq_bench.robots.errors import RobotsError

FARTHEST = 1000.0
"""The longest way that can be asked for [m]: a choice, longer than any world's."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One value that a behaviour is written with: what it is, how it is ``read`` from text, whether it may be left out.

    ``read`` raises ``ValueError`` that tells what is valid.
    """

    name: str
    meaning: str
    read: Callable[[str], Any]
    optional: bool = False


@dataclass(frozen=True, slots=True)
class BehaviourKind:
    """One behaviour: the ``code`` that it is written with, what it does, its arguments, and how it is made."""

    code: str
    title: str
    arguments: tuple[Argument, ...]
    make: Callable[..., Behaviour]
    example: str

    @property
    def form(self) -> str:
        """Its written form, such as ``MA:x,y[,heading]``."""
        text = ""
        for argument in self.arguments:
            comma = "," if text else ""
            text += f"[{comma}{argument.name}]" if argument.optional else f"{comma}{argument.name}"
        if not text:
            return self.code
        return f"{self.code}[:{text[1:]}" if text.startswith("[") else f"{self.code}:{text}"


@dataclass(frozen=True, slots=True)
class ParsedBehaviour:
    """A behaviour with its values, as somebody asked for it in ``text``."""

    kind: BehaviourKind
    values: tuple[Any, ...]
    text: str


def number(low: float, high: float, unit: str, *, but_zero: bool = False) -> Callable[[str], float]:
    """Reader of a number from ``low`` to ``high``."""
    valid = f"valid is a number from {low:g} to {high:g}" + (f" {unit}" if unit else "")
    valid += ", but not 0" if but_zero else ""

    def read(text: str) -> float:
        try:
            value = float(text.replace("_", "x"))  # Python takes 1_5 for 15
        except ValueError:
            raise ValueError(valid) from None
        if not low <= value <= high or (but_zero and value == 0):
            raise ValueError(valid)
        return value

    return read


def degrees(most: float, *, but_zero: bool = False) -> Callable[[str], float]:
    """Reader of an angle in degrees, to radians."""
    read = number(-most, most, "degrees", but_zero=but_zero)
    return lambda text: math.radians(read(text))


def member(of: type[Enum]) -> Callable[[str], Enum]:
    """Reader of an enum by its members' names in small letters."""
    by_name = {item.name.lower(): item for item in of}

    def read(text: str) -> Enum:
        if text not in by_name:
            raise ValueError(f"valid are {', '.join(by_name)}")
        return by_name[text]

    return read


def _follow(
    robot: RobotDescription, finder: DoorFinder | None, side: WallSide, distance: float, length: float | None = None
) -> FollowWall:
    if distance < closest(robot):
        raise RobotsError(f"distance {distance:g} m to a wall: valid is {closest(robot):g} m or more for this robot")
    return FollowWall(robot, side, distance, length)


def _cross(robot: RobotDescription, finder: DoorFinder | None, side: CrossingSide = CrossingSide.AHEAD) -> CrossDoor:
    if finder is None:
        raise RobotsError("crossing a door needs something that finds doors in a scan: none was given")
    return CrossDoor(robot, finder, side)


_LENGTH = number(0.01, FARTHEST, "m")
_ASIDE = number(0.0, FIRST_REACH, "m")
_RADIUS = number(0.1, 10.0, "m")
_COORDINATE = number(-FARTHEST, FARTHEST, "m")

KINDS: tuple[BehaviourKind, ...] = (
    BehaviourKind(
        "MA",
        "go to a set point, from where the robot is",
        (
            Argument("x", "ahead [m]", _COORDINATE),
            Argument("y", "to the left [m]", _COORDINATE),
            Argument("heading", "where it looks in the end, against now [degrees]", degrees(360), optional=True),
        ),
        lambda robot, finder, *values: SetPoint(robot, *values),
        "MA:3,0,90",
    ),
    BehaviourKind(
        "MT",
        "turn about itself, or on an arc",
        (
            Argument("angle", "to the left where positive [degrees]", degrees(360, but_zero=True)),
            Argument("radius", "of the arc [m]; without it, about itself", _RADIUS, optional=True),
        ),
        lambda robot, finder, *values: Turn(robot, *values),
        "MT:-180",
    ),
    BehaviourKind(
        "MO",
        "turn to the nearest thing",
        (Argument("bearing", "where the thing is to be, to the left where positive [degrees]", degrees(180), True),),
        lambda robot, finder, *values: Orient(robot, *values),
        "MO:90",
    ),
    BehaviourKind(
        "MW",
        "follow a wall",
        (
            Argument("side", "where the wall is: left, right", member(WallSide)),
            Argument("distance", "from the middle of the axle to the wall [m]", number(0.1, FIRST_REACH, "m")),
            Argument("length", "of the way [m]; without it, until the wall ends", _LENGTH, optional=True),
        ),
        _follow,
        "MW:left,0.6",
    ),
    BehaviourKind(
        "MC",
        "cross a door",
        (Argument("side", "which door: ahead (default), left, right", member(CrossingSide), optional=True),),
        _cross,
        "MC",
    ),
    BehaviourKind(
        "MN",
        "carry on, clear of what stands in the way",
        (
            Argument("length", "of the way [m]", _LENGTH),
            Argument("left", "from the middle of the axle to the wall that it keeps to [m], 0: none", _ASIDE, True),
            Argument("right", "likewise", _ASIDE, True),
            Argument(
                "aside", "of its way, to the left of where it stands [m]", number(-FIRST_REACH, FIRST_REACH, "m"), True
            ),
            Argument("turn", "of its way, to the left of where it looks [degrees]", degrees(90), True),
        ),
        lambda robot, finder, *values: CarryOn(robot, *values),
        "MN:2.5,0.9",
    ),
    BehaviourKind("stop", "stand still", (), lambda robot, finder: Halt(robot), "stop"),
)
"""All behaviours."""


def behaviour_kind(code: str) -> BehaviourKind:
    """The behaviour that is written with a code; raises ``RobotsError`` for an unknown one."""
    for item in KINDS:
        if item.code == code:
            return item
    raise RobotsError(f"unknown behaviour '{code}': valid are {', '.join(item.form for item in KINDS)}")


def parse_behaviour(text: str) -> ParsedBehaviour:
    """Read a behaviour as it is written; raises ``RobotsError`` with the value, its place and what is valid."""
    code, colon, rest = text.partition(":")
    chosen = behaviour_kind(code.strip())
    given = [part.strip() for part in rest.split(",")] if colon else []
    needed = sum(not argument.optional for argument in chosen.arguments)
    if not needed <= len(given) <= len(chosen.arguments):
        raise RobotsError(f"behaviour '{text}': {len(given)} values: valid is {chosen.form}, such as {chosen.example}")
    return ParsedBehaviour(chosen, tuple(map(_value, [text] * len(given), chosen.arguments, given)), text)


def _value(text: str, argument: Argument, given: str) -> Any:
    try:
        return argument.read(given)
    except ValueError as error:
        raise RobotsError(f"behaviour '{text}': {argument.name} '{given}': {error}") from None


def make_behaviour(choice: ParsedBehaviour, robot: RobotDescription, finder: DoorFinder | None = None) -> Behaviour:
    """Make a behaviour for a robot; ``finder`` finds the doors in a scan.

    Raises ``RobotsError`` for what this robot cannot do.
    """
    try:
        return choice.kind.make(robot, finder, *choice.values)
    except RobotsError as error:
        raise RobotsError(f"behaviour '{choice.text}': {error}") from None
