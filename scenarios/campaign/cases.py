"""Scenario files to cases: reading, expanding, and checking all that can be checked before the first drive."""

import math
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

import robots
from refseq.errors import RefseqError
from refseq.profile import profile_named
from robots.errors import RobotsError
from scenarios.campaign.expect import Expectation, parse
from scenarios.campaign.schema import QUERY_SEEDS, DriveTable, LogTable, Scenario, SourceTable
from scenarios.campaign.sources import Images, Log, Source
from scenarios.campaign.vary import Values, merged, put, variations
from scenarios.errors import ScenarioError
from scenarios.methods import check_methods
from scenarios.record import OWN_ROUTE, Drive, check_sensors, driven, plan_of
from sim.bench import CONTROL_PERIOD
from sim.cameras import load_camera
from sim.errors import SimError
from sim.laser import RangeMode
from sim.operator import OperatorStyle
from sim.recorder import Trigger
from worlds.errors import WorldsError
from worlds.light import light_named

LIBRARY = Path(__file__).resolve().parent.parent / "library"
"""Folder of the scenarios that come with the bench."""
QUERY_ALONE = ("faults",)
"""Keys of a drive that the query does not take over from the reference."""


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a scenario file: its name, what it varies, and all that it declares.

    ``name`` is the file's, and after a stroke the case's own where the file makes several.
    """

    name: str
    file: Path
    varied: Values
    scenario: Scenario
    expectations: tuple[Expectation, ...]

    def sources(self, seed: int) -> tuple[Source, Source]:
        """Reference and query of a seed."""
        limits = self.scenario.limits
        reference, query = self.scenario.reference, self.scenario.query
        return (
            _source(reference, seed, limits.steps, self.file),
            _source(query, seed + QUERY_SEEDS, limits.steps, self.file),
        )


def names() -> tuple[str, ...]:
    """Scenarios of the library."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml") if _is_scenario(path)))


def _is_scenario(path: Path) -> bool:
    """Not a floor plan that lies beside the scenarios that drive in it."""
    return "reference" in _table(path)


def find(names_or_files: Sequence[str]) -> list[Case]:
    """The cases of scenarios by their names, tags, files, or names of single cases; each once.

    Raises ``ScenarioError`` for a name that is none of these, and for a file that is no scenario.
    """
    found: dict[str, Case] = {}
    for wanted in names_or_files:
        for case in _found(wanted):
            found.setdefault(case.name, case)
    return list(found.values())


def _found(wanted: str) -> list[Case]:
    if wanted.endswith(".toml"):
        return load(Path(wanted))
    name, stroke, _ = wanted.partition("/")
    if name in names():
        cases = load(LIBRARY / f"{name}.toml")
        chosen = [case for case in cases if not stroke or case.name == wanted]
        if not chosen:
            raise ScenarioError(f"case {wanted!r} is unknown; valid are {', '.join(case.name for case in cases)}")
        return chosen
    tagged = [case for each in names() for case in load(LIBRARY / f"{each}.toml") if wanted in case.scenario.tags]
    if not tagged:
        tags = sorted({tag for each in names() for tag in _table(LIBRARY / f"{each}.toml").get("tags", [])})
        raise ScenarioError(
            f"scenario {wanted!r} is unknown; valid are {', '.join(names())}, a tag ({', '.join(tags)}), or a path "
            "ending in .toml"
        )
    return tagged


def load(path: Path) -> list[Case]:
    """The cases of a scenario file. Raises ``ScenarioError`` with the file, the key and what is valid."""
    table = _table(path)
    try:
        cases = [_case(path, name, values, put(table, values)) for name, values in variations(table.pop("vary", None))]
    except (ScenarioError, SimError, WorldsError, RobotsError, RefseqError) as error:
        raise ScenarioError(f"{path}: {error}") from error
    return cases


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}; valid is a scenario (.toml)") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: is no TOML: {error}") from error


def _case(path: Path, name: str, values: Values, table: dict[str, Any]) -> Case:
    for side in ("reference", "query"):
        if not isinstance(table.get(side, {}), dict):
            raise ScenarioError(f"{side}: is no table; valid is [{side}]")
    table["query"] = merged(table.get("reference", {}), table.get("query", {}), QUERY_ALONE)
    try:
        scenario = Scenario.model_validate(table)
    except ValidationError as error:
        raise ScenarioError(_first_mistake(error)) from error
    expectations = tuple(parse(text, scenario.localise.profile) for text in scenario.expect)
    full = f"{path.stem}/{name}" if name else path.stem
    case = Case(full, path, values, scenario, expectations)
    _check(case)
    return case


def _first_mistake(error: ValidationError) -> str:
    """The first of pydantic's findings in one line: the key, what is wrong, and what was given."""
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"] if part not in ("drive", "log", "images"))
    if first["type"] == "extra_forbidden":
        return f"{where}: is not known here"
    given = "" if first["type"] == "missing" else f", not {str(first['input'])!r:.80}"
    return f"{where}: {first['msg'][0].lower()}{first['msg'][1:]}{given}"


# --- what is declared, as what is simulated or read ---


def _source(table: SourceTable, seed: int, steps: int, file: Path) -> Source:
    if isinstance(table, LogTable):
        return Log(table.log, table.views, table.thin, seed if table.odometry_noise else None)
    if isinstance(table, DriveTable):
        return _drive(table, seed, steps, file)
    return Images(table.images, table.spacing, table.width)


def _drive(table: DriveTable, seed: int, steps: int, file: Path) -> Drive:
    trigger = table.trigger
    return Drive(
        world=_beside(table.world, file),
        light=table.light,
        change=table.change,
        change_seed=table.change_seed,
        robot=table.robot,
        route=table.route,
        seed=seed,
        world_seed=table.world_seed,
        renderer=table.renderer,
        trigger=Trigger(trigger.distance or None, math.radians(trigger.turn) or None, trigger.time or None),
        style=OperatorStyle(strength=table.operator),
        cameras={camera: _beside(model, file) for camera, model in table.cameras.items()},
        laser=RangeMode[f"METRES_{table.laser_range}"],
        waypoints=table.waypoints,
        start=table.start,
        end=table.end,
        faults=table.faults,
        patience=steps * CONTROL_PERIOD,
    )


def _beside(name: str, file: Path) -> str:
    """A file that a scenario names, as seen from the scenario's own folder; other names as they are."""
    return str(file.resolve().parent / name) if name.endswith(".toml") else name


# --- what can be told before the first drive ---


def _check(case: Case) -> None:
    scenario = case.scenario
    profile_named(scenario.localise.profile)
    check_methods(scenario.methods)
    for expectation in case.expectations:
        for method in expectation.methods:
            if method not in scenario.methods:
                valid = ", ".join(scenario.methods)
                raise ScenarioError(f"expect: {expectation.text!r}: {method!r} does not run here; valid are {valid}")
        if expectation.seeds > len(scenario.seeds):
            raise ScenarioError(f"expect: {expectation.text!r}: there are {len(scenario.seeds)} seeds")
    if scenario.judged not in scenario.methods:
        raise ScenarioError(f"localise.judged: {scenario.judged!r} does not run here: {', '.join(scenario.methods)} do")
    if len(set(scenario.seeds)) < len(scenario.seeds):
        raise ScenarioError(f"seeds: {list(scenario.seeds)} holds one twice")
    for side, source in zip(("reference", "query"), case.sources(scenario.seeds[0]), strict=True):
        if isinstance(source, Drive):
            with _place(side):
                _check_drive(source, scenario.localise.sensors)


@contextmanager
def _place(side: str) -> Iterator[None]:
    """Name the table in which something is wrong."""
    try:
        yield
    except (ScenarioError, SimError, WorldsError, RobotsError) as error:
        raise ScenarioError(f"{side}: {error}") from error


def _check_drive(drive: Drive, sensors: Sequence[str] | None) -> None:
    robot = robots.load(drive.robot)
    check_sensors(tuple(sensors or ()), robot)
    light_named(drive.light)
    for camera, model in drive.cameras.items():
        check_sensors((camera,), robot)
        load_camera(model)
    check_route(drive)


def check_route(drive: Drive) -> float:
    """Length of what is driven [m]. Raises ``WorldsError``, ``ScenarioError`` for what the world does not have."""
    plan = plan_of(drive)
    name = OWN_ROUTE if drive.waypoints else drive.route
    if name not in plan.routes:
        raise ScenarioError(f"unknown route {name!r} in world {plan.name!r}: valid are {', '.join(plan.routes)}")
    route = driven(np.array(plan.routes[name]), drive)
    return float(np.hypot(*np.diff(route, axis=0).T).sum())
