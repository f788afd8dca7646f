"""Missions as files that people write: a step a table, with tasks, and where landmarks are.

::

    title = "Look into the second office"
    landmarks = { LA3 = "end" }

    [[step]]
    at = "LD"
    tasks = [{ photograph = "first" }]

    [[step]]
    at = "LD"
    do = "MC"
    timeout = 120
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from refseq.missions import (
    ADMITTED,
    BehaviourCode,
    Call,
    Errand,
    Landmark,
    Landmarks,
    Mission,
    MissionError,
    MissionPath,
    Photograph,
    Plan,
    Step,
    Task,
    Wait,
    compiled,
    parse_mission,
)
from refseq_bench.robots.behaviours.written import parse_behaviour
from refseq_bench.robots.errors import RobotsError
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.text_file import TextFileError, read_toml

NAME = r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,59}$"
"""Pattern of the name of a photograph or a function: it becomes part of a file's name."""


@dataclass(frozen=True)
class Asked:
    """A mission as somebody asked for it: its steps, what belongs to them, and where landmarks are."""

    mission: Mission
    landmarks: Landmarks
    errands: tuple[Errand, ...]
    title: str = ""

    def for_way(self, way: MissionPath) -> Plan:
        """Compile it. Raises ``MissionError``."""
        return compiled(self.mission, way, self.landmarks, self.errands)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _TaskTable(_Table):
    """One of the three."""

    wait: Annotated[float, Field(strict=True, gt=0, le=3600)] | None = None
    photograph: Annotated[str, Field(pattern=NAME)] | None = None
    call: Annotated[str, Field(pattern=NAME)] | None = None

    def task(self) -> Task:
        """The task. Raises ``ValueError`` for none or several."""
        given: list[Task] = []
        if self.wait is not None:
            given.append(Wait(self.wait))
        if self.photograph is not None:
            given.append(Photograph(self.photograph))
        if self.call is not None:
            given.append(Call(self.call))
        if len(given) != 1:
            raise ValueError(f"{len(given)} of wait, photograph and call; valid is one of them a task")
        return given[0]


class _StepTable(_Table):
    at: str
    do: str | None = None
    tasks: tuple[_TaskTable, ...] = ()
    timeout: Annotated[float, Field(strict=True, gt=0)] | None = None


class _MissionTable(_Table):
    title: str = ""
    step: Annotated[tuple[_StepTable, ...], Field(min_length=1)]
    landmarks: dict[str, float | str] = {}


def asked_for(text: str, landmarks: dict[str, float | str] | None = None) -> Asked:
    """A mission from a string, or from a file whose name ends in ``.toml``; ``landmarks`` come on top of the file's.

    Raises ``MissionError`` for a string, ``ScenarioError`` for a file that cannot be read.
    """
    if text.endswith(".toml"):
        found = read_mission(Path(text))
        return Asked(
            found.mission, located({**found.landmarks.places, **(landmarks or {})}), found.errands, found.title
        )
    mission = parse_mission(text)
    return Asked(mission, located(landmarks or {}), (Errand(),) * len(mission.steps))


def located(places: dict[str, float | str]) -> Landmarks:
    """Landmarks by their names. Raises ``MissionError`` for a name that is none."""
    for name in places:
        landmark_named(name)
    return Landmarks(places)


def landmark_named(name: str) -> Landmark:
    """A landmark by its name, such as ``LA3``. Raises ``MissionError``."""
    steps = parse_mission(f"[{name}]").steps
    if len(steps) != 1 or steps[0].action is not None:
        raise MissionError(f"landmark {name!r:.40} is not valid; it should be one landmark, as LA3")
    return steps[0].landmark


def read_mission(path: Path) -> Asked:
    """Read a mission file. Raises ``ScenarioError`` in one line that names the file, the key and what is valid."""
    try:
        return mission_in(read_toml(path))
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid is a mission in TOML") from None
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def mission_in(tables: object) -> Asked:
    """A mission from the tables of a file. Raises ``ScenarioError`` with the key and what is valid."""
    try:
        table = _MissionTable.model_validate(tables)
        steps, errands = zip(*map(_step, range(1, len(table.step) + 1), table.step), strict=True)
        return Asked(Mission(steps), located(table.landmarks), errands, table.title)
    except ValidationError as error:
        raise ScenarioError(_mistake(error)) from error
    except (MissionError, RobotsError, ValueError) as error:
        raise ScenarioError(str(error)) from error


def _step(number: int, table: _StepTable) -> tuple[Step, Errand]:
    try:
        tasks = tuple(one.task() for one in table.tasks)
        if table.do is not None and ":" in table.do:
            return Step(landmark_named(table.at)), Errand(_in_words(table.at, table.do), tasks, table.timeout)
        return parse_mission(f"[{landmark_named(table.at)}{table.do or ''}]").steps[0], Errand(
            None, tasks, table.timeout
        )
    except (MissionError, RobotsError, ValueError) as error:
        raise MissionError(f"step {number}: {error}") from None


def _in_words(at: str, behaviour: str) -> str:
    """A behaviour in a robot's words. Raises for one that is none, or not done at a landmark."""
    code, admitted = parse_behaviour(behaviour).kind.code, ADMITTED[landmark_named(at).label]
    if code not in list(BehaviourCode) or BehaviourCode(code) not in admitted:
        raise MissionError(f"{code} is not done at {at}; valid are {', '.join(admitted)}")
    return behaviour


def _mistake(error: ValidationError) -> str:
    first: Any = error.errors()[0]
    where = ".".join(str(part + 1) if isinstance(part, int) else str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"{where}: is not known here; valid are {', '.join(_keys(first['loc']))}"
    if first["type"] == "missing":
        return f"{where}: is missing"
    return f"{where} = {first['input']!r:.60} is not valid: {first['msg'][0].lower()}{first['msg'][1:]}"


def _keys(loc: tuple[int | str, ...]) -> tuple[str, ...]:
    kinds: dict[int, type[BaseModel]] = {1: _MissionTable, 3: _StepTable, 5: _TaskTable}
    return tuple(kinds.get(len(loc), _MissionTable).model_fields)
