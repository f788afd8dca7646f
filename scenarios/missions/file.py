"""Missions as files that people write: a step a table, with tasks, and where landmarks are.

::

    title = "Look into the second office"
    landmarks = { LA3 = "end" }
    scenes = { LI1 = "poster.scene" }

    [[step]]
    at = "LI1"
    tasks = [{ photograph = "first" }]

    [[step]]
    at = "LD"
    do = "MC"
    timeout = 120
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from refseq.errors import SceneError
from refseq.missions import (
    ADMITTED,
    BehaviourCode,
    Call,
    Errand,
    Label,
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
from refseq.scenes import Scene, SceneFinder, load_scene
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
    scenes: dict[str, str] = {}


def asked_for(
    text: str, landmarks: Mapping[str, float | str] | None = None, scenes: Mapping[str, Path] | None = None
) -> Asked:
    """A mission from a string, or from a file whose name ends in ``.toml``.

    ``landmarks`` and the files of ``scenes`` come on top of the file's. Raises ``MissionError`` for a string,
    ``SceneError`` for a scene, ``ScenarioError`` for a file that cannot be read.
    """
    if text.endswith(".toml"):
        found = read_mission(Path(text))
    else:
        mission = parse_mission(text)
        found = Asked(mission, Landmarks(), (Errand(),) * len(mission.steps))
    places = {**found.landmarks.places, **(landmarks or {})}
    given = located(places, {**found.landmarks.scenes, **_loaded(scenes or {})})
    for name in given.scenes:
        if landmark_named(name) not in [step.landmark for step in found.mission.steps]:
            raise MissionError(f"scene {name}: no step of {found.mission} is at it; valid is a landmark of its steps")
    return replace(found, landmarks=given)


def located(places: Mapping[str, float | str], scenes: Mapping[str, Scene] | None = None) -> Landmarks:
    """Landmarks by their names. Raises ``MissionError`` for a name that is none, or of what a camera does not find."""
    for name in (*places, *(scenes or {})):
        landmark_named(name)
    for name in scenes or {}:
        if landmark_named(name).label is not Label.IMAGE:
            raise MissionError(f"scene {name}: a scene is an image; valid is a name as {Label.IMAGE}1")
        if name in places:
            raise MissionError(f"{name} has a place and a scene; valid is one of them")
    return Landmarks(places, scenes or {})


def _loaded(files: Mapping[str, Path]) -> dict[str, Scene]:
    return {name: _findable(file) for name, file in files.items()}


def _findable(file: Path) -> Scene:
    scene = load_scene(file)
    try:
        SceneFinder(scene)
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from None
    return scene


def landmark_named(name: str) -> Landmark:
    """A landmark by its name, such as ``LA3``. Raises ``MissionError``."""
    steps = parse_mission(f"[{name}]").steps
    if len(steps) != 1 or steps[0].action is not None:
        raise MissionError(f"landmark {name!r:.40} is not valid; it should be one landmark, as LA3")
    return steps[0].landmark


def read_mission(path: Path) -> Asked:
    """Read a mission file. Raises ``ScenarioError`` in one line that names the file, the key and what is valid."""
    try:
        return mission_in(read_toml(path), path.parent)
    except SceneError as error:
        raise ScenarioError(f"{path}: scenes: {error}") from error
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid is a mission in TOML") from None
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def mission_in(tables: object, folder: Path | None = None) -> Asked:
    """A mission from the tables of a file; its scenes' files lie in ``folder``, None: it may name none.

    Raises ``ScenarioError`` with the key and what is valid, ``SceneError`` for a scene.
    """
    try:
        table = _MissionTable.model_validate(tables)
        steps, errands = zip(*map(_step, range(1, len(table.step) + 1), table.step), strict=True)
        _check_names(errands)
        if table.scenes and folder is None:
            raise ScenarioError("scenes: are files, which are not here; valid is a mission's file beside them")
        scenes = _loaded({name: (folder or Path()) / file for name, file in table.scenes.items()})
        return Asked(Mission(steps), located(table.landmarks, scenes), errands, table.title)
    except ValidationError as error:
        raise ScenarioError(_mistake(error)) from error
    except (MissionError, RobotsError, ValueError) as error:
        raise ScenarioError(str(error)) from error


def _check_names(errands: Sequence[Errand]) -> None:
    """Raise ``ScenarioError`` where two photographs have one name: the later would take the place of the first."""
    known: dict[str, int] = {}
    for number, errand in enumerate(errands, 1):
        for name in [task.name for task in errand.tasks if isinstance(task, Photograph)]:
            if name in known:
                raise ScenarioError(
                    f"step {number}: photograph {name!r} is that of step {known[name]}; valid is a name of its own"
                )
            known[name] = number


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
