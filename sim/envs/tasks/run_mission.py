"""The task to carry out a mission along a path that was learnt: a given one, or one drawn for each episode."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from refseq.belief import LOST_ABOVE
from refseq.missions.behaviour_codes import kind_of
from refseq.missions.language import BehaviourCode, Mission, MissionError, parse_mission
from refseq.missions.path import MissionPath
from refseq.missions.plan import WALL, Landmarks, Plan, Where, compiled
from refseq.missions.true_way import TrueWay, distance_to
from refseq_bench.sim.bench.polyline import Polyline
from refseq_bench.sim.drives.view_spacing import MISSION_EVERY
from refseq_bench.sim.envs.tasks.mission_draw import draw_mission
from refseq_bench.sim.envs.tasks.mission_goal import WITHIN, doorway_near, goal_of
from refseq_bench.sim.envs.tasks.task import AskedOrder, Episode, Looking, Situation, Task, TaskGround
from refseq_bench.sim.errors import SimError

WRONG = 1.0
"""Taken off the reward for a behaviour that begins where the mission has none: a choice, two metres' worth of way."""
ASIDE, TURNED = 0.02, math.radians(0.5)
"""A start is so far beside the route's and turned from it at the most [m, rad]: choices, it is set down with care."""
STOP = "stop"
EXTRA = {BehaviourCode.SET_POINTS: "MA:1000,0", BehaviourCode.FOLLOW_WALL: WALL}
"""Actions that are there only where the mission asks for them."""


class OnMission(Episode):
    """Reward: the metres made good along the mission's true way, less ``WRONG`` for each wrong switch.

    The way is the path's up to the last landmark, and on through the door where that one is crossed. A switch is
    another behaviour than before, and there is none among twists; it is wrong farther than ``WITHIN`` from where the
    plan has that behaviour, as in the missions' score. To stand is right near the goal, and where the localiser says
    lost.
    """

    def __init__(self, ground: TaskGround, mission: Mission, plan: Plan, aside: float, turned: float) -> None:
        assert ground.places is not None, "tasks with a map are given its places"
        self.start = ground.way.pose(0.0, aside, turned)
        self.plan, self._mission = plan, mission
        truth = TrueWay(plan.path, ground.places)
        self._goal = goal_of(plan, truth, ground)
        self._where = [(kind_of(one.behaviour), truth.where(plan, n)) for n, one in enumerate(plan.orders)]
        learnt = truth.stretch(0.0, plan.goal)
        self._way = Polyline(np.concatenate([learnt, self._goal.beyond]))
        self._along, self._wrong = 0.0, 0
        self.asked = asked_by(plan)

    def begin(self, situation: Situation) -> float:
        """Look at the robot before its first step; returns what remains."""
        self._before = situation
        return super().begin(situation)

    def remaining(self, situation: Situation) -> float:
        """The way to the mission's end, and off it [m]."""
        self._along, off = self._way.project(situation.pose, self._along)
        return self._way.length - self._along + off

    def reached(self, situation: Situation) -> bool:
        """True if the mission is done in truth."""
        return self._goal.reached(situation)

    def fee(self, situation: Situation) -> float:
        """``WRONG`` where the step began with a wrong switch."""
        before, self._before = self._before, situation
        # Whoever has chosen nothing yet stands; twists are no behaviours, and so none of them is wrong.
        same = situation.behaviour in ("", before.behaviour or STOP)
        if same or self._right(situation.behaviour, before):
            return 0.0
        self._wrong += 1
        return WRONG

    def _right(self, behaviour: str, where: Situation) -> bool:
        if behaviour == STOP:
            lost = where.belief is not None and where.belief.lost > LOST_ABOVE
            return lost or self._goal.near(where, WITHIN)
        here = np.array([where.pose.x, where.pose.y])
        kind = kind_of(behaviour)
        return any(distance_to(line, here) <= WITHIN for asked, line in self._where if asked == kind)

    @property
    def told(self) -> Mapping[str, Any]:
        """The mission, and how many switches were wrong."""
        return {"mission": str(self._mission), "wrong_switches": self._wrong}


def asked_by(plan: Plan) -> tuple[AskedOrder, ...]:
    """Behaviours of a plan in their order, without those that only go on; the last is to stand, if nothing else is."""
    found: list[AskedOrder] = []
    for order in plan.orders:
        if not (found and order.travels and kind_of(order.behaviour) == kind_of(found[-1].behaviour)):
            found.append(AskedOrder(order.at, order.behaviour))
    if plan.orders[-1].travels:
        found.append(AskedOrder(plan.goal, STOP))
    return tuple(found)


class RunMissionTask(Task):
    """Carry out a ``mission``, or for None one that is drawn for each episode (``draw_mission``).

    ``landmarks`` say where objects and properties are [m along the path, ``start`` or ``end``]. Raises ``SimError`` for
    a mission that cannot be read, or not be done along the path.
    """

    behaviours: tuple[str, ...] = ("MN:1000", "MT:90", "MT:180", "MT:270", "MC:left", "MC:right", "MC:ahead", STOP)
    mapped = asks = True
    looking = Looking(distance=MISSION_EVERY, turn=None, standing=True)
    keywords = ("mission", "landmarks")

    def __init__(self, mission: str | None = None, landmarks: Mapping[str, Where] | None = None) -> None:
        if landmarks and mission is None:
            raise SimError("landmarks are for a mission of your own; valid is with mission=…")
        self._landmarks = _placed({} if landmarks is None else landmarks)
        self._mission = None if mission is None else _parsed(mission)
        actions = [step.action.behaviour for step in self._mission.steps if step.action] if self._mission else []
        self.behaviours += tuple(EXTRA[code] for code in EXTRA if code in actions)

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Begin where the path was begun when it was learnt, as missions do."""
        assert ground.learnt is not None, "tasks with a map are given its path"
        mission = self._mission or self._drawn(ground, ground.learnt, rng)
        plan = self._compiled(mission, ground.learnt)
        aside, turned = rng.uniform((-ASIDE, -TURNED), (ASIDE, TURNED))
        return OnMission(ground, mission, plan, aside, turned)

    def _drawn(self, ground: TaskGround, way: MissionPath, rng: np.random.Generator) -> Mission:
        assert ground.places is not None, "tasks with a map are given its places"
        truth = TrueWay(way, ground.places)
        crossable = [
            number
            for number, door in enumerate(way.doors)
            if door.passable and doorway_near(ground, truth.position(door.along)) is not None
        ]
        mission = draw_mission(way, crossable, rng)
        if mission is None:
            raise SimError(f"world {ground.plan.name!r}: no landmark on the path; valid is a longer one, or a mission")
        return mission

    def _compiled(self, mission: Mission, way: MissionPath) -> Plan:
        try:
            plan = compiled(mission, way, self._landmarks)
        except MissionError as error:
            raise SimError(str(error)) from None
        known = {kind_of(behaviour) for behaviour in self.behaviours}
        for order in plan.orders:
            if kind_of(order.behaviour) not in known:
                valid = ", ".join(self.behaviours)
                raise SimError(f"mission {mission}: {order.behaviour} ({order.why}) is no action; valid are {valid}")
        return plan


def _placed(landmarks: object) -> Landmarks:
    if not isinstance(landmarks, Mapping):
        raise SimError(f"landmarks {landmarks!r:.60} is not valid; valid is a table such as {{'LA3': 'end'}}")
    for name, where in landmarks.items():
        if not isinstance(name, str) or not isinstance(where, int | float | str):
            raise SimError(
                f"landmarks: {name!r:.60} at {where!r:.60} is not valid; valid is a name such as 'LA3' at metres along "
                "the way, 'start' or 'end'"
            )
    return Landmarks(dict(landmarks))


def _parsed(mission: object) -> Mission:
    if not isinstance(mission, str):
        raise SimError(f"mission {mission!r:.60} is not valid; valid is a string such as '[LD_LDMC]'")
    try:
        return parse_mission(mission)
    except MissionError as error:
        raise SimError(str(error)) from None
