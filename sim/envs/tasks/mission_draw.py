"""Draw missions for a path from a grammar: past doors and images, to stand, to turn or to cross an open door.

::

    mission = "[" { step "_" } last "]"
    step    = "LD"
    last    = "LD" | "LD" turn | "LDMC" | image | image turn
    image   = "LI" number
    turn    = "MT90" | "MT180" | "MT270"
"""

from collections.abc import Sequence

import numpy as np

from refseq.missions.language import TURNS, Action, BehaviourCode, Label, Landmark, Mission, Step
from refseq.missions.path import MissionPath
from refseq_bench.sim.envs.tasks.reach_place import NEAREST

DOOR = Landmark(Label.DOOR)


def draw_mission(way: MissionPath, crossable: Sequence[int], rng: np.random.Generator) -> Mission | None:
    """A mission along a way, None where it has no landmark; ``crossable`` are the numbers of the doors to go through.

    It ends no nearer to the path's start than the task to reach a place has its goals, ``NEAREST``.
    All kinds of last steps that the way has room for are as likely, and so are their places.
    """
    doors = [number for number, door in enumerate(way.doors) if door.along >= NEAREST]
    images = [number for number, along in enumerate(way.along.tolist()) if along >= NEAREST]
    turns: list[Action | None] = [Action(BehaviourCode.TURN, angle) for angle in TURNS]
    crossing = [number for number in crossable if number in doors]
    stand: list[Action | None] = [None]
    cross: list[Action | None] = [Action(BehaviourCode.CROSS_DOOR)]
    kinds = [
        (Label.DOOR, doors, stand),
        (Label.DOOR, doors, turns),
        (Label.DOOR, crossing, cross),
        (Label.IMAGE, images, stand),
        (Label.IMAGE, images, turns),
    ]
    kinds = [kind for kind in kinds if kind[1]]
    if not kinds:
        return None
    label, places, actions = kinds[int(rng.integers(len(kinds)))]
    number, action = int(rng.choice(places)), actions[int(rng.integers(len(actions)))]
    if label is Label.DOOR:
        return Mission((*[Step(DOOR)] * number, Step(DOOR, action)))
    passed = sum(door.along < way.along[number] for door in way.doors)
    told = int(rng.integers(passed + 1))
    return Mission((*[Step(DOOR)] * told, Step(Landmark(label, number), action)))
