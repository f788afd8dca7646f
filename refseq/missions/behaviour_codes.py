"""Behaviours in robots' own words, such as ``MN:8`` or ``MW:left,0.6,5``, as far as a mission has to know them.

What the words mean is the robots' business (``refseq_bench.robots.behaviours.written``); a mission knows which
behaviours last until a place is reached, and how these are told how far.
"""

from refseq.missions.language import BehaviourCode

SHORTEST = 0.05
"""No way is told that is shorter than this [m]: robots take less for no way at all."""
AHEAD = "ahead"
"""Side of a door that is crossed where none is told."""
LONGEST = 1000.0
"""Nor one that is longer [m]: it can be told again."""


def code_of(behaviour: str) -> str:
    """The code of a behaviour: ``MN`` of ``MN:8``."""
    return behaviour.partition(":")[0]


def travels(behaviour: str) -> bool:
    """True where a behaviour lasts until a place is reached: carrying on, following a wall, and straight set points."""
    code, _, rest = behaviour.partition(":")
    if code == BehaviourCode.SET_POINTS:
        return _straight(rest)
    return code in (BehaviourCode.CARRY_ON, BehaviourCode.FOLLOW_WALL)


def lengthened(behaviour: str, length: float) -> str:
    """A behaviour that travels, for a way of ``length`` [m]."""
    code, _, rest = behaviour.partition(":")
    way = f"{min(max(length, SHORTEST), LONGEST):.2f}"
    match code:
        case BehaviourCode.FOLLOW_WALL:
            side, distance = rest.split(",")[:2]
            return f"{code}:{side},{distance},{way}"
        case BehaviourCode.SET_POINTS:
            return f"{code}:{way},0"
        case _:
            return ",".join([f"{code}:{way}", *rest.split(",")[1:]])


def steered(behaviour: str, aside: float, turn: float) -> str:
    """A led leg, such as ``MN:8,1.2,0.9``, on a way ``aside`` [m] and turned by ``turn`` [degrees], both to the left.

    Other behaviours find their way by themselves, and are as they were.
    """
    is_leg = code_of(behaviour) == BehaviourCode.CARRY_ON and behaviour.count(",") == 2
    return f"{behaviour},{aside:.2f},{turn:.1f}" if is_leg else behaviour


def length_of(behaviour: str) -> float:
    """Length of the way that a behaviour is told [m]; 0 where it ends by itself, or is told none."""
    if not travels(behaviour):
        return 0.0
    code, _, rest = behaviour.partition(":")
    values = rest.split(",")
    try:
        return float(values[2 if code == BehaviourCode.FOLLOW_WALL else 0])
    except (IndexError, ValueError):
        return 0.0


def turn_of(behaviour: str) -> float:
    """Angle of a turn [degrees]."""
    return float(behaviour.partition(":")[2].split(",")[0])


def kind_of(behaviour: str) -> str:
    """A behaviour in one spelling for all that lead the same way: lengths do not count, and 270 degrees are -90."""
    code, _, rest = behaviour.partition(":")
    if travels(behaviour):
        return lengthened(behaviour, 1.0)
    match code:
        case BehaviourCode.TURN:
            return f"{code}:{turn_of(behaviour) % 360:g}"
        case BehaviourCode.CROSS_DOOR:
            return f"{code}:{rest or AHEAD}"
        case _:
            return behaviour


def _straight(values: str) -> bool:
    """True where a set point is straight ahead and asks for no heading."""
    if not values:
        return True
    x, *rest = values.split(",")
    try:
        return float(x) > 0 and len(rest) == 1 and float(rest[0]) == 0
    except ValueError:
        return False
