"""Requests of the page as missions: the way, its plan, and the drive."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from refseq.errors import MapError
from refseq.map.map import Map
from refseq.missions import ADMITTED, BehaviourCode, Label, Plan, as_learnt, parse_mission
from refseq.missions.language import TURNS
from refseq_bench import robots
from refseq_bench.scenarios.drives.route import plan_of
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.missions.file import Asked, mission_in
from refseq_bench.scenarios.missions.trip import MissionTrip
from refseq_bench.scenarios.missions.way import way_between
from refseq_bench.worlds.light import light_named

MOST_STEPS = 200
WORDS = {
    "MN": "carry on",
    "MA": "straight by odometer",
    "MT90": "turn 90° left",
    "MT180": "turn about",
    "MT270": "turn 90° right",
    "MO": "turn to the nearest thing",
    "MC": "cross the door",
    "MW": "follow the wall",
}
"""Behaviours of a mission string, as the page calls them."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, str_max_length=400)


class DriveRequest(_Part):
    """The drive of a mission; what is empty is the map's. ``speed`` is simulated over real time, 0: without a limit."""

    light: str = ""
    change: str = "none"
    robot: str = ""
    seed: Annotated[int, Field(ge=0, le=2**31)] = 1001
    start: Annotated[float, Field(ge=0)] = 0.0
    renderer: Literal["", "baked", "filament", "classic", "none"] = ""
    every: Annotated[float, Field(ge=0.05, le=100)] = 0.6
    odometry: bool = False
    speed: Annotated[float, Field(ge=0, le=100)] = 0.0

    def trip(self, map_: Map, world: str | None = None, *, takes_pictures: bool = False) -> MissionTrip:
        """The same for the library, in a ``world``, None: the map's.

        Raises the rooms' errors for names that nobody knows.
        """
        trip = MissionTrip.from_map(
            map_,
            world=world,
            light=self.light or None,
            change=self.change,
            robot=self.robot or None,
            at=self.start,
            seed=self.seed,
            renderer=self.renderer or None,
            odometry=self.odometry,
            every=self.every,
            takes_pictures=takes_pictures,
        )
        light_named(trip.drive.light)
        plan_of(trip.drive)
        robots.load(trip.drive.robot)
        return trip


class MissionRequest(_Part):
    """A mission on a map: steps as in a mission's file, or none: as it was learnt, from one place to another."""

    map: str
    start: str = ""
    goal: str = ""
    steps: Annotated[tuple[dict[str, Any], ...], Field(max_length=MOST_STEPS)] = ()
    landmarks: Annotated[dict[str, float | str], Field(max_length=MOST_STEPS)] = {}
    drive: DriveRequest = DriveRequest()

    @classmethod
    def read(cls, told: dict[str, Any]) -> "MissionRequest":
        """Read what the page sent. Raises ``ScenarioError``."""
        try:
            return cls.model_validate(told)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise ScenarioError(f"{where} = {first['input']!r:.60} is not valid: {first['msg']}") from None


@dataclass(frozen=True)
class PlannedMission:
    """A mission that can be done: its plan, and the mission as a string, empty where it is done as learnt."""

    plan: Plan
    text: str


def planned(request: MissionRequest, map_: Map) -> PlannedMission:
    """Compile a request. Raises ``MissionError`` and others in one line."""
    way = way_between(map_, request.start, request.goal)
    if not request.steps:
        return PlannedMission(as_learnt(way), "")
    asked: Asked = mission_in({"step": request.steps, "landmarks": request.landmarks})
    return PlannedMission(asked.for_way(way), str(asked.mission))


def steps_of(text: str) -> list[dict[str, str]]:
    """A mission string as steps of a file. Raises ``MissionError``."""
    steps = parse_mission(text).steps
    return [{"at": str(one.landmark), **({"do": str(one.action)} if one.action else {})} for one in steps]


def behaviours_offered() -> dict[str, list[tuple[str, str]]]:
    """Behaviours that are done at each kind of landmark, as a mission string has them and in words."""
    turns = {code: TURNS if code is BehaviourCode.TURN else ("",) for code in BehaviourCode}
    codes = {label: [f"{code}{turn}" for code in ADMITTED[label] for turn in turns[code]] for label in Label}
    return {label: [(code, WORDS[code]) for code in codes[label]] for label in Label}


def drawn_plan(found: PlannedMission, points: Any) -> dict[str, Any]:
    """A plan as the page shows it: its orders, and the way with its places."""
    plan, way = found.plan, found.plan.path
    if len(way.places) < 2:
        raise MapError("the way has no length: it begins at its goal; valid are two places apart")
    return {
        "text": found.text,
        "goal": round(plan.goal, 2),
        "length": round(way.length, 2),
        "way": {"places": way.places.tolist(), "along": [round(float(one), 2) for one in way.along]},
        "points": [[round(float(x), 2), round(float(y), 2)] for x, y in points[way.places]],
        "orders": [
            {
                "at": round(order.at, 2),
                "do": order.behaviour,
                "why": order.why,
                "tasks": [str(one) for one in order.tasks],
            }
            for order in plan.orders
        ],
        "tasks": [str(one) for one in plan.tasks],
    }
