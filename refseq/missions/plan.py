"""A mission compiled for a way: what to do from where on, with every landmark found on the way once, in their order.

Behaviours are robots' own words, such as ``MN:8``; a plan says where each begins, not how long it lasts.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import pairwise, takewhile

from refseq.behaviours import begun
from refseq.map.paths.annotations import DoorSide, PathDoor
from refseq.missions.behaviour_codes import code_of, kind_of, lengthened, travels, turn_of
from refseq.missions.language import Action, BehaviourCode, Label, Landmark, Mission, MissionError, Step
from refseq.missions.path import MissionPath
from refseq.missions.tasks import Photograph, Task
from refseq.scenes import Scene

BEFORE_DOOR = 1.2
"""Crossing a door begins so far before the robot is abreast of it [m]: a choice, where the laser sees all of it."""
AT_ONCE = 2.0
"""Range around a landmark [m] in which its own behaviour replaces those that were learnt: a choice."""
SLIGHT = 30.0
"""A turn by less that was learnt belongs to no landmark [degrees]: a choice; missions turn by 90 at least."""
WALL = "MW:right,1"
"""Behaviour that ``MW`` means in a string, which has no room for side and distance: a choice."""
END, START = "end", "start"

Where = float | str
"""A place on the way: metres from its start, ``start`` or ``end``."""


@dataclass(frozen=True, slots=True)
class Order:
    """From ``at`` [m along the way] on the robot does ``behaviour``; ``why`` says who wants it.

    ``tasks`` are done there first, while it stands. ``timeout`` [s] is how long it may last, None: as long as its way
    may take. It is ``learnt`` where the way was driven so, and no step of a mission asks for it.
    """

    at: float
    behaviour: str
    why: str
    tasks: tuple[Task, ...] = ()
    timeout: float | None = None
    learnt: bool = False

    @property
    def travels(self) -> bool:
        """True where it lasts until a place is reached."""
        return travels(self.behaviour)

    def continues(self, before: "Order") -> bool:
        """True where it only goes on with the one before."""
        both = self.travels and before.travels and not self.tasks
        return both and lengthened(self.behaviour, 1.0) == lengthened(before.behaviour, 1.0)


@dataclass(frozen=True)
class Plan:
    """Orders along a way, the first at its start; the mission is over at ``goal`` [m along it].

    An order that ends by itself and is the last one ends the mission, wherever that leaves the robot. Where a landmark
    is ``sought`` nobody knows the rest yet: the plan goes on as learnt, to the end of the way at most.
    """

    path: MissionPath
    orders: tuple[Order, ...]
    goal: float
    tasks: tuple[Task, ...] = ()
    """Those that are done at the goal."""
    sought: "Sought | None" = None

    @property
    def all_tasks(self) -> tuple[Task, ...]:
        """Tasks of all orders, those at the goal, and what steps behind a scene ask for, some of it once more."""
        behind = [task for errand in self._errands_behind for task in errand.tasks]
        return (*(task for order in self.orders for task in order.tasks), *self.tasks, *behind)

    @property
    def all_behaviours(self) -> tuple[str, ...]:
        """Words of all orders, and of steps behind a scene, some of them once more."""
        behind = [errand.behaviour for errand in self._errands_behind]
        return (*(order.behaviour for order in self.orders), *filter(None, behind))

    @property
    def _errands_behind(self) -> "tuple[Errand, ...]":
        return self.sought.errands if self.sought else ()

    @property
    def photographs(self) -> bool:
        """True where a task is to take a photograph."""
        return any(isinstance(task, Photograph) for task in self.all_tasks)

    @property
    def takes_pictures(self) -> bool:
        """True where a camera looks for a scene, or takes a photograph."""
        return self.sought is not None or self.photographs

    def end_of(self, number: int) -> float:
        """Place where the order after this one begins [m along the way]."""
        return self.orders[number + 1].at if number + 1 < len(self.orders) else max(self.goal, self.orders[number].at)

    def order_at(self, along: float) -> int:
        """Number of the order that is in force at a place; of several that begin there, the last one."""
        return max(sum(1 for _ in takewhile(lambda order: order.at <= along, self.orders)) - 1, 0)

    def __str__(self) -> str:
        """A line an order."""
        lines = [f"{order.at:6.1f} m  {order.behaviour:<12} {order.why}" for order in self.orders]
        last = self.orders[-1]
        if self.sought is not None:
            lines.append(f"{'':>8}  {'looks for':<12} {self.sought}")
        elif last.travels or self.goal > last.at:
            lines.append(f"{self.goal:6.1f} m  {'stop':<12} the mission ends here")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Errand:
    """A step's part that has no room in the string: another behaviour in the robot's words, tasks."""

    behaviour: str | None = None
    tasks: tuple[Task, ...] = ()
    timeout: float | None = None


NO_ERRAND = Errand()


@dataclass(frozen=True)
class Landmarks:
    """Landmarks as people say them, by name: ``places``, such as ``LA3`` at ``end``, or at 12.5 [m].

    ``scenes`` are landmarks of which only the look is known: a camera finds them on the way.
    """

    places: Mapping[str, Where] = field(default_factory=dict)
    scenes: Mapping[str, Scene] = field(default_factory=dict)

    def placed(self, name: str, at: float) -> "Landmarks":
        """The same, once one of the scenes has a place [m along the way]."""
        return replace(self, places={**self.places, name: at})

    def seeks(self, landmark: Landmark) -> bool:
        """True for a scene without a place."""
        return str(landmark) in self.scenes and str(landmark) not in self.places


@dataclass(frozen=True)
class Sought:
    """A landmark that a camera looks for, that of a step's ``number``; it lies more than ``after`` [m] along the way.

    It is the mission's first without a place; steps behind it are matched when it has one.
    """

    mission: Mission
    landmarks: Landmarks
    errands: tuple[Errand, ...]
    number: int
    after: float

    @property
    def name(self) -> str:
        """The landmark's name, such as ``LI1``."""
        return str(self.mission.steps[self.number].landmark)

    @property
    def scene(self) -> Scene:
        """Its look."""
        return self.landmarks.scenes[self.name]

    def found(self, way: MissionPath, at: float) -> Plan:
        """The plan, now that the landmark is known to be there [m along the way]. Raises ``MissionError``."""
        return compiled(self.mission, way, self.landmarks.placed(self.name, at), self.errands)

    def __str__(self) -> str:
        step, scene = self.mission.steps[self.number], self.scene
        return f"{step}: box {scene.box} of {scene.camera}, cut from {scene.drive or 'a drive'} at {scene.along:.1f} m"


def as_learnt(way: MissionPath) -> Plan:
    """The way itself as a mission (X3): all that was done is done again where it was done."""
    return Plan(way, _learnt(way), way.length)


def compiled(
    mission: Mission, way: MissionPath, landmarks: Landmarks | None = None, errands: Sequence[Errand] | None = None
) -> Plan:
    """A mission for a way: what its steps do in place of what was learnt, up to its last landmark.

    Doors are the way's, each once and in their order: the first step at a door means the first one, and between two
    such steps none is left out. Images are places of the way by their number, objects and other places lie where
    ``landmarks`` say; of scenes only the first that has no place is ``sought``, and the plan ends there. ``errands``
    are one a step. Raises ``MissionError`` for a landmark that is not on the way, or not behind the one before, for
    steps behind one that leaves the way, for other than one errand a step, and for words of one that lack numbers.
    """
    landmarks, errands = landmarks or Landmarks(), _one_a_step(mission, errands or (NO_ERRAND,) * len(mission.steps))
    matched, steps = _matched(mission, way, landmarks), len(mission.steps)
    orders = list(_learnt(way))
    for number, (at, errand) in enumerate(zip(matched, errands, strict=False), 1):
        learnt = _done_there(orders, at)
        if _wanted(at, errand) is None:
            learnt = learnt[:1]  # the others are done as well
        with _step(mission, number):
            order = _order(orders, learnt, at, errand)
            if number < steps and _leaves(order, learnt):
                raise MissionError(
                    f"{at.step} leaves the way, and behind that no landmark is known; valid is as the last step"
                )
        orders = _with(order, [one for one in orders if one not in learnt])
    if len(matched) < steps:
        after = matched[-1].at if matched else 0.0
        return Plan(way, tuple(orders), way.length, sought=Sought(mission, landmarks, errands, len(matched), after))
    return _up_to(way, orders, order, stops=_wanted(at, errand) is None)


def _one_a_step(mission: Mission, errands: Sequence[Errand]) -> tuple[Errand, ...]:
    if len(errands) != len(mission.steps):
        raise MissionError(
            f"mission {mission}: {len(errands)} errands for {len(mission.steps)} steps; valid is one a step"
        )
    for number, errand in enumerate(errands, 1):
        with _step(mission, number):
            _check_words(errand.behaviour or "")
    return tuple(errands)


def _up_to(way: MissionPath, orders: Sequence[Order], last: Order, *, stops: bool) -> Plan:
    """A mission ends with its last step: there, where nobody said what to do, when that is done, or with the way."""
    before = tuple(orders[: orders.index(last)])
    if stops:
        return Plan(way, before or (replace(last, tasks=()),), last.at, last.tasks)
    if not last.travels:
        return Plan(way, (*before, last), last.at)
    return Plan(way, tuple(orders), way.length)


def _with(order: Order, orders: Sequence[Order]) -> list[Order]:
    """A step's order among the others: behind those of the steps before, and before what was learnt right there.

    What goes on with something else takes the place of what would have begun there.
    """
    if order.travels:
        orders = [one for one in orders if one.at != order.at or not one.travels or not one.learnt]
    before = list(takewhile(lambda one: one.at < order.at or (one.at == order.at and not one.learnt), orders))
    return [*before, order, *orders[len(before) :]]


@dataclass(frozen=True, slots=True)
class _Matched:
    """A step and where its landmark is [m along the way]; ``door`` where it is one."""

    step: Step
    at: float
    told: str
    door: PathDoor | None = None


def _matched(mission: Mission, way: MissionPath, landmarks: Landmarks) -> list[_Matched]:
    """The steps with their places, up to the first whose place has to be seen."""
    found: list[_Matched] = []
    for number, step in enumerate(mission.steps, 1):
        if landmarks.seeks(step.landmark):
            break
        with _step(mission, number):
            found.append(_match(step, way, landmarks, found[-1] if found else None))
    return found


@contextmanager
def _step(mission: Mission, number: int) -> Iterator[None]:
    """Name the step in what goes wrong with it."""
    try:
        yield
    except MissionError as error:
        raise MissionError(f"mission {mission}, step {number}: {error}") from None


def _match(step: Step, way: MissionPath, landmarks: Landmarks, before: _Matched | None) -> _Matched:
    landmark, last = step.landmark, before.at if before else -1e-9
    if landmark.label is Label.DOOR and str(landmark) not in landmarks.places:
        if before is not None and before.door is not None:
            doors = way.doors[way.doors.index(before.door) + 1 :]  # one across from it is another one
        else:
            doors = tuple(door for door in way.doors if door.along > last)
        door = next(iter(doors), None)
        if door is None:
            raise MissionError(f"no door behind {max(last, 0):.1f} m; the way has {len(way.doors)} doors")
        return _Matched(step, door.along, f"{step}: door {door.beside}, {door.along:.1f} m", door)
    at = _place(landmark, way, landmarks)
    if at <= last:
        raise MissionError(f"{landmark} is at {at:.1f} m; valid is behind the landmark before it, at {last:.1f} m")
    return _Matched(step, at, f"{step}: at {at:.1f} m")


def _place(landmark: Landmark, way: MissionPath, landmarks: Landmarks) -> float:
    name = str(landmark)
    where = landmarks.places.get(name)
    if where is None and landmark.label is Label.IMAGE and landmark.number is not None:
        if landmark.number >= len(way.along):
            raise MissionError(f"{name} is not on the way; valid is LI0 to LI{len(way.along) - 1}")
        return float(way.along[landmark.number])
    if where is None:
        said = ", ".join(landmarks.places) or "none"
        raise MissionError(f"nobody has said where {name} is; landmarks with a place: {said}")
    if isinstance(where, str):
        if where not in (START, END):
            raise MissionError(f"{name} is at {where!r}; valid is metres along the way, '{START}' or '{END}'")
        return way.length if where == END else 0.0
    if not 0 <= where <= way.length:
        most = math.floor(10 * way.length) / 10  # rounded up it would not be valid
        raise MissionError(f"{name} is at {where:g} m; valid is 0 to {most:.1f} m, the way's length")
    return float(where)


def _learnt(way: MissionPath) -> tuple[Order, ...]:
    """Orders for all that was done along a way. Raises ``MissionError`` for words that tell no behaviour."""
    orders = [
        Order(max(at + offset, 0.0), behaviour, "as learnt", learnt=True)
        for words, at in zip(way.behaviours, way.along.tolist(), strict=True)
        for offset, behaviour in _begun(words)
    ]
    for order in orders:
        _check_words(order.behaviour, ", as it was learnt,")
    if not orders or orders[0].at > 0:
        orders.insert(0, Order(0.0, BehaviourCode.CARRY_ON, "nobody told how the way begins", learnt=True))
    # At the last place nothing begins.
    return tuple(order for order in orders if order.at < way.length or not order.travels) or tuple(orders[:1])


def _begun(words: str) -> list[tuple[float, str]]:
    try:
        return begun(words)
    except ValueError:
        raise MissionError(
            f"behaviour {words!r:.40}, as it was learnt, begins nowhere; valid is MT:90@0.31, say"
        ) from None


def _check_words(behaviour: str, told: str = "") -> None:
    """Raise ``MissionError`` for words, as a log of others may hold them, that lack numbers of their behaviour."""
    try:
        kind_of(behaviour)
    except ValueError:
        raise MissionError(
            f"behaviour {behaviour!r:.40}{told} lacks numbers; valid are MW:left,0.5,4 and MT:90, say"
        ) from None


def _wanted(at: _Matched, errand: Errand) -> str | None:
    """Behaviour that a step wants, in a robot's words; None: what was learnt."""
    return errand.behaviour or (None if at.step.action is None else _words(at.step.action, at.door))


def _done_there(orders: Sequence[Order], at: _Matched) -> list[Order]:
    """Orders learnt for a landmark: a turn or a crossing right there."""
    there = (order for order in orders if order.learnt and not order.travels and abs(order.at - at.at) <= AT_ONCE)
    return [order for order in there if not _is_slight(order.behaviour)]


def _is_slight(behaviour: str) -> bool:
    """True for a turn that only corrects the way."""
    return code_of(behaviour) == BehaviourCode.TURN and abs(turn_of(behaviour)) < SLIGHT


def _order(orders: Sequence[Order], learnt: Sequence[Order], at: _Matched, errand: Errand) -> Order:
    """A step as an order, in place of what was ``learnt`` for its landmark."""
    order = Order(at.at, "", at.told, errand.tasks, errand.timeout)
    wanted, in_force = _wanted(at, errand), _in_force(orders, at.at)
    if wanted is None and learnt:
        return replace(order, at=learnt[0].at, behaviour=learnt[0].behaviour)
    if wanted is None or (wanted == BehaviourCode.CARRY_ON and not learnt):
        if not in_force.travels:
            raise MissionError(f"{at.told}: in the middle of {in_force.behaviour} nothing can be done")
        return replace(order, behaviour=in_force.behaviour)
    if code_of(wanted) == BehaviourCode.CROSS_DOOR:
        crossed = [one.at for one in learnt if code_of(one.behaviour) == BehaviourCode.CROSS_DOOR]
        asked = max((one.at for one in orders if not one.learnt), default=0.0)
        order = replace(order, at=crossed[0] if crossed else max(at.at - BEFORE_DOOR, asked))
    return replace(order, behaviour=wanted)


def _leaves(order: Order, learnt: Sequence[Order]) -> bool:
    """True where an order leads off the way: it turns or crosses where that was not done, or the reverse."""
    wanted = {_turning(order.behaviour)} if not order.travels else set()
    return wanted != {_turning(one.behaviour) for one in learnt}


def _turning(behaviour: str) -> str:
    """Part of a behaviour that decides where it leads: crossing or not, and by which angle, for 270 degrees are -90."""
    code = code_of(behaviour)
    return f"{code}:{turn_of(behaviour) % 360:g}" if code == BehaviourCode.TURN else code


def _in_force(orders: Sequence[Order], at: float) -> Order:
    return next((one for one, after in pairwise(orders) if one.at <= at < after.at), orders[-1])


def _words(action: Action, door: PathDoor | None) -> str:
    """An action in a robot's words."""
    match action.behaviour:
        case BehaviourCode.TURN:
            return f"{action.behaviour}:{action.turn}"
        case BehaviourCode.CROSS_DOOR:
            return f"{action.behaviour}:{door.side if door else DoorSide.AHEAD}"
        case BehaviourCode.FOLLOW_WALL:
            return WALL
        case _:
            return str(action.behaviour)
