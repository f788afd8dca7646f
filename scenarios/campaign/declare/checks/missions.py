"""Check a mission before the first drive: names, strings, landmarks, files."""

import re
from collections.abc import Sequence
from pathlib import Path

from refseq.missions import BehaviourCode, Call, Label, MissionError
from refseq.missions.lamp import LampStage
from refseq_bench import robots
from refseq_bench.scenarios.campaign.declare.assignment import LAMP, LEADERS, Target
from refseq_bench.scenarios.campaign.declare.schema import DriveTable, MissionScenario, MissionTable
from refseq_bench.scenarios.campaign.declare.sources import Source, names_of
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.checks import check_methods
from refseq_bench.scenarios.methods.names import is_hindsight
from refseq_bench.scenarios.missions.file import Asked, asked_for, located
from refseq_bench.scenarios.missions.lamp import read_program

END = "end"
ENDED = (Label.IMAGE, Label.DOOR)
"""Landmarks that are on the way by themselves: nobody has to say where."""


def asked_mission(table: MissionTable, file: Path) -> Asked | None:
    """The mission of a string or of a file; None where another one is meant. Raises the rooms' own errors."""
    if table.string is None:
        return None
    try:
        located(dict(table.landmarks))
    except MissionError as error:
        raise ScenarioError(f"mission.landmarks: {error}") from error
    text = str(file.resolve().parent / table.string) if table.string.endswith(".toml") else table.string
    try:
        return asked_for(text, dict(table.landmarks))
    except (MissionError, ScenarioError) as error:
        raise ScenarioError(f"mission.string: {error}") from error


def target_of(table: MissionTable) -> Target | None:
    """The place of ``to``. Raises ``ScenarioError`` for what is no place."""
    if table.to is None:
        return None
    found = re.fullmatch(r"(.+):(end|[0-9]{1,6}(?:\.[0-9]{1,6})?)", table.to)
    if found is None:
        raise ScenarioError(
            f"mission.to = {table.to!r:.60} is not valid; it should be PATH:end or PATH:12.5, in metres"
        )
    return Target(found[1], None if found[2] == END else float(found[2]))


def program_of(table: MissionTable, file: Path) -> tuple[LampStage, ...]:
    """The stages of the program for ``lamp``, none where there is none. Raises the rooms' own errors."""
    if table.lamp is None:
        return ()
    try:
        return read_program(file.resolve().parent / table.lamp)
    except (MissionError, ScenarioError) as error:
        raise ScenarioError(f"mission.lamp: {error}") from error


def check_leaders(names: Sequence[str], *, programmed: bool) -> None:
    """Raise ``ScenarioError`` for the first name of somebody who cannot lead a robot."""
    for name in names:
        if name == LAMP and not programmed:
            raise ScenarioError(f"localise.methods: {LAMP!r} has no program here; valid is to name one: mission.lamp")
        if is_hindsight(name):
            raise ScenarioError(f"localise.methods: {name!r} knows a place when the drive is over; valid are others")
        if name not in LEADERS:
            try:
                check_methods([name])
            except ScenarioError as error:
                raise ScenarioError(f"localise: {error}, {', '.join(LEADERS)}") from error


def check_mission(scenario: MissionScenario, file: Path, references: Sequence[Source]) -> None:
    """Raise the rooms' own errors for what cannot be a mission; ``file`` is the scenario's."""
    table = scenario.mission
    _check_drives(scenario)
    _check_kind(scenario)
    asked, target = asked_mission(table, file), target_of(table)
    stages = program_of(table, file)
    if asked is not None:
        _check_asked(asked, table)
    elif table.landmarks:
        raise ScenarioError("mission.landmarks: go with a string; valid is mission.string beside them")
    if target is not None and target.path not in (paths := names_of(references)):
        raise ScenarioError(f"mission.to = {table.to!r}: path {target.path!r} is unknown; valid are {', '.join(paths)}")
    if target is None and scenario.further:
        raise ScenarioError("further: goes with mission.to, a route over all references; valid is one reference")
    if stages:
        robot = robots.load(_drive(scenario, "query").robot)
        if not robot.sonars:
            raise ScenarioError(f"mission.lamp: robot '{robot.name}' has no sonars; valid is one such as 'robuter'")


def _check_drives(scenario: MissionScenario) -> None:
    """All are simulated, and what the robot does on the query is the mission's to say."""
    for number, table in enumerate((*scenario.references, scenario.query)):
        if not isinstance(table, DriveTable):
            side = ("reference", *["further"] * len(scenario.further), "query")[number]
            raise ScenarioError(f"{side}: is a recording; valid in a mission is a drive to simulate: world")
    if _drive(scenario, "query").behaviours:
        raise ScenarioError("query.behaviours: what the robot does is the mission's to say; valid is none")


def _drive(scenario: MissionScenario, side: str) -> DriveTable:
    table = getattr(scenario, side)
    assert isinstance(table, DriveTable)
    return table


def _check_kind(scenario: MissionScenario) -> None:
    """One way to say what is to be done."""
    table = scenario.mission
    said = [key for key, given in (("string", table.string), ("learnt", table.learnt), ("to", table.to)) if given]
    if len(said) > 1:
        raise ScenarioError(f"mission: {' and '.join(said)} exclude each other; valid is one of string, learnt, to")
    others = [name for name in scenario.methods if name != LAMP]
    if not said and others:
        raise ScenarioError(f"mission: what {others[0]} is to do is missing; valid is one of string, learnt, to")


def _check_asked(asked: Asked, table: MissionTable) -> None:
    for step in asked.mission.steps:
        landmark = step.landmark
        if landmark.label not in ENDED and str(landmark) not in asked.landmarks.places:
            said = ", ".join(asked.landmarks.places) or "none"
            raise ScenarioError(
                f"mission.landmarks: nobody has said where {landmark} is; landmarks with a place: {said}"
            )
    for name in (task.name for errand in asked.errands for task in errand.tasks if isinstance(task, Call)):
        raise ScenarioError(f"mission.string: call {name!r}: a scenario has no functions; valid are wait, photograph")
    last, errand = asked.mission.steps[-1], asked.errands[-1]
    action = errand.behaviour or str(last.action or "")
    if action.startswith(BehaviourCode.CROSS_DOOR) and table.goal is None:
        raise ScenarioError(
            f"mission.goal: is missing; what {last} leads to was never learnt, valid is [x, y] in metres"
        )
