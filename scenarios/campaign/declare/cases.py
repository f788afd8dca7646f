"""Scenario files to cases: reading, expanding, and checking all that can be checked before the first drive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from refseq_bench.scenarios.campaign.declare.drivable import check_drive, check_learnable, check_signal_faults, named
from refseq_bench.scenarios.campaign.declare.drive_seeds import added_seeds, check_apart
from refseq_bench.scenarios.campaign.declare.expand import Values, expanded, put
from refseq_bench.scenarios.campaign.declare.expectations import Expectation, check_decides
from refseq_bench.scenarios.campaign.declare.real_recordings import Images, Log
from refseq_bench.scenarios.campaign.declare.schema import (
    Declared,
    DriveTable,
    LogTable,
    Scenario,
    SourceTable,
    is_drawn,
    kind_of,
)
from refseq_bench.scenarios.campaign.declare.schema_types import schema_type_for, schema_type_of
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.campaign.declare.validation_errors import first_error
from refseq_bench.scenarios.drives.record import Drive
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.scenarios.methods.chosen_on import refuse_chosen_on
from refseq_bench.sim.bench.bench import CONTROL_PERIOD
from refseq_bench.sim.drives.operator import style_named
from refseq_bench.sim.drives.recorder import Trigger
from refseq_bench.sim.sensors.laser import RangeMode
from refseq_bench.text_file import TextFileError, read_toml

SOURCE_KEYS = {"world", "log", "images"}
"""Keys of which each says what kind of source a table is; a query of another kind takes over nothing."""
EACH_SEED = "SEED"
"""Stands for the seed in a generated world's name."""
ONLY_SEED = (1,)
"""Seeds by default where nothing is drawn from them."""


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a scenario file: its name, what it varies, and all that it declares.

    ``name`` is the file's, and after a stroke the case's own where the file makes several.
    """

    name: str
    file: Path
    varied: Values
    scenario: Declared
    expectations: tuple[Expectation, ...]

    def sources(self, seed: int) -> tuple[Source, ...]:
        """The references of a seed, and last the query."""
        return tuple(self.source(side, seed) for side in self.sides)

    @property
    def sides(self) -> tuple[str, ...]:
        """The keys of the references, and last of the query."""
        return tuple(self.tables)

    @property
    def tables(self) -> dict[str, SourceTable]:
        """Keys of the declared references, and last of the query."""
        added = added_seeds(len(self.scenario.further))
        return dict(zip(added, (*self.scenario.references, self.scenario.query), strict=True))

    def source(self, side: str, seed: int) -> Source:
        """The reference or query of a seed that is declared under a key."""
        table, own = self.tables[side], seed + added_seeds(len(self.scenario.further))[side]
        if isinstance(table, DriveTable):
            table = table.model_copy(update={"world": of_seed(table.world, seed)})
        return _source(table, own, self.scenario.limits.steps, self.file)


def of_seed(world: str, seed: int) -> str:
    """The world of a seed: ``building:SEED`` is another building for each, reference and query alike."""
    kind, colon, rest = world.partition(":")
    number, comma, dials = rest.partition(",")
    return f"{kind}:{seed}{comma}{dials}" if colon and number == EACH_SEED else world


def names() -> tuple[str, ...]:
    """Scenarios of the library."""
    files = ((path, path.stat().st_mtime_ns) for path in LIBRARY.glob("*.toml"))
    return tuple(sorted(path.stem for path, changed_ns in files if _is_scenario(path, changed_ns)))


@cache
def _is_scenario(path: Path, changed_ns: int) -> bool:
    """Not a floor plan that lies beside the scenarios that drive in it."""
    return "reference" in _table(path)


def find(names_or_files: Sequence[str], *, runnable: bool = True) -> list[Case]:
    """The cases of scenarios by their names, tags, files, or names of single cases; each once.

    Where they need not be ``runnable``, as in a list, it is not asked whether they can be run, which is half the time.

    Raises ``ScenarioError`` for a name that is none of these, for a file that is no scenario, and for two files of one
    name, whose cases nobody could tell apart.
    """
    found: dict[str, Case] = {}
    for case in (case for wanted in names_or_files for case in _found(wanted, runnable)):
        first = found.setdefault(case.name, case)
        if first.file.resolve() != case.file.resolve():
            raise ScenarioError(
                f"{first.file} and {case.file}: both make a case {case.name!r}; valid are names that differ"
            )
    return list(found.values())


def _found(wanted: str, runnable: bool) -> list[Case]:
    if wanted.endswith(".toml"):
        return load(Path(wanted), runnable=runnable)
    name, stroke, _ = wanted.partition("/")
    if name in names():
        cases = load(LIBRARY / f"{name}.toml", runnable=runnable)
        chosen = [case for case in cases if not stroke or case.name == wanted]
        if not chosen:
            raise ScenarioError(f"case {wanted!r} is unknown; valid are {', '.join(case.name for case in cases)}")
        return chosen
    tags = {each: _table(LIBRARY / f"{each}.toml").get("tags", []) for each in names()}
    tagged = [each for each, of_file in tags.items() if wanted in of_file]
    if not tagged:
        valid = ", ".join(sorted({tag for of_file in tags.values() for tag in of_file}))
        raise ScenarioError(
            f"scenario {wanted!r} is unknown; valid are {', '.join(names())}, a tag ({valid}), or a path "
            "that ends in .toml"
        )
    return [case for each in tagged for case in load(LIBRARY / f"{each}.toml", runnable=runnable)]


def load(path: Path, *, runnable: bool = True) -> list[Case]:
    """The cases of a scenario file, ``runnable`` as in ``find``.

    Raises ``ScenarioError`` with the file, the key and what is valid.
    """
    table, checked = _table(path), set[str]()
    try:
        cases = [_case(path, name, values, put(table, values)) for name, values in expanded(table.pop("vary", None))]
        for case in cases if runnable else ():
            _check(case, checked)
    except input_errors() as error:
        raise ScenarioError(f"{path}: {' '.join(str(error).split())}") from error
    return cases


def _table(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid is a scenario in TOML") from None


def _case(path: Path, name: str, values: Values, table: dict[str, Any]) -> Case:
    for side in ("reference", "query"):
        if not isinstance(table.get(side, {}), dict):
            raise ScenarioError(f"{side}: is no table; valid is [{side}]")
    further = table.get("further", [])
    if not isinstance(further, list) or not all(isinstance(one, dict) for one in further):
        raise ScenarioError("further: is no list of tables; valid is [[further]], once for each further reference")
    reference = table.get("reference", {})
    schema_type = schema_type_of(table)
    table["query"] = {
        **schema_type.query_defaults,
        **_completed(table.get("query", {}), reference, schema_type.not_inherited),
    }
    table["further"] = [_completed(one, reference, ("faults",)) for one in further]
    try:
        scenario = schema_type.model.model_validate(table)
    except ValidationError as error:
        raise ScenarioError(first_error(error, schema_type.model)) from error
    if "seeds" not in scenario.model_fields_set and not scenario.is_drawn:
        scenario = scenario.model_copy(update={"seeds": ONLY_SEED})
    expectations = tuple(schema_type.expectation(text, scenario) for text in scenario.expect)
    full = f"{path.stem}/{name}" if name else path.stem
    return Case(full, path, values, scenario, expectations)


def _completed(source: dict[str, Any], reference: Mapping[str, Any], own: Sequence[str]) -> dict[str, Any]:
    """A source with all that it does not say as in the reference, but its ``own``, if it is of the same kind."""
    if SOURCE_KEYS & set(source) and kind_of(source) != kind_of(reference):
        return source
    return {**{key: value for key, value in reference.items() if key not in own}, **source}


# --- what is declared, as what is simulated or read ---


def _source(table: SourceTable, seed: int, steps: int, file: Path) -> Source:
    if isinstance(table, LogTable):
        noise = seed if table.odometry_noise else None
        return Log(
            table.log,
            views=table.views,
            thin=table.thin,
            noise=noise,
            truth=table.truth,
            odometry=table.odometry,
            topics=table.topics,
            tolerance=table.tolerance,
            late=table.late,
            beside=file.resolve().parent,
        )
    if isinstance(table, DriveTable):
        return _drive(table, seed, steps, file)
    return Images(table.images, table.spacing, table.width, beside=file.resolve().parent)


def _drive(table: DriveTable, seed: int, steps: int, file: Path) -> Drive:
    trigger = table.trigger
    return Drive(
        world=_beside(table.world, file),
        light=table.light,
        change=table.change,
        change_seed=table.change_seed,
        robot=table.robot,
        robot_spread=table.robot_spread,
        route=table.route,
        seed=seed,
        world_seed=table.world_seed,
        renderer=table.renderer,
        trigger=Trigger(trigger.distance or None, math.radians(trigger.turn) or None, trigger.time or None),
        style=replace(style_named(table.operator_style), strength=table.operator, side=table.side),
        cameras={camera: _beside(model, file) for camera, model in table.cameras.items()},
        laser=RangeMode[f"METRES_{table.laser_range}"],
        waypoints=table.waypoints,
        start=table.start,
        end=table.end,
        faults=table.faults,
        behaviours=table.behaviours,
        patience=steps * CONTROL_PERIOD,
    )


def _beside(name: str, file: Path) -> str:
    """A file that a scenario names, as seen from the scenario's own folder; other names as they are."""
    return str(file.resolve().parent / name) if name.endswith(".toml") else name


# --- what can be told before the first drive ---


def check_chosen_elsewhere(case: Case) -> None:
    """Raise ``ScenarioError`` where a case that keeps seeds for training tests a method on a world it was chosen in."""
    scenario = case.scenario
    if scenario.training_seeds and not {*scenario.seeds} & {*scenario.training_seeds}:
        tables = [table for table in (*scenario.references, scenario.query) if isinstance(table, DriveTable)]
        refuse_chosen_on(scenario.methods, (of_seed(table.world, seed) for table in tables for seed in scenario.seeds))


def check_drawn(case: Case) -> None:
    """Raise ``ScenarioError`` for several seeds from which nothing is drawn.

    All would have the same views, and what is one drive would be taken for so many when differences are judged.
    """
    scenario = case.scenario
    if len(scenario.seeds) > 1 and not scenario.is_drawn:
        raise ScenarioError(
            f"seeds: {list(scenario.seeds)}: nothing is drawn from a seed here, and the same views would be counted "
            f"{len(scenario.seeds)} times; valid is one seed, such as {list(ONLY_SEED)}"
        )


def check_drives_apart(case: Case) -> None:
    """Raise ``ScenarioError`` for seeds, with those for training, whose drives would draw the same random numbers."""
    scenario, added = case.scenario, added_seeds(len(case.scenario.further))
    drawn = {side: added[side] for side, table in case.tables.items() if is_drawn(table)}
    check_apart((*scenario.seeds, *scenario.training_seeds), drawn)


def check_judged(scenario: Declared) -> None:
    """Raise ``ScenarioError`` where the method that is judged does not run: a page would tell of nobody."""
    if scenario.judged not in scenario.methods:
        valid, missing = ", ".join(scenario.methods), "" if scenario.localise.judged else "missing, and its default "
        raise ScenarioError(f"localise.judged: {missing}{scenario.judged!r} does not run here; valid are {valid}")


def _check(case: Case, checked: set[str]) -> None:
    """Raise for a case that cannot be run; drives ``checked`` before are not checked again, as most of a file's are."""
    scenario = case.scenario
    schema_type = schema_type_for(scenario)
    schema_type.check_methods(scenario)
    for expectation in case.expectations:
        for method in expectation.methods:
            if method not in scenario.methods:
                valid = ", ".join(scenario.methods)
                raise ScenarioError(f"expect: {expectation.text!r}: {method!r} does not run here; valid are {valid}")
        with named("expect"):
            check_decides(expectation, scenario.judged)
        if expectation.seeds > len(scenario.seeds):
            there = f"{len(scenario.seeds)} seed{'s' * (len(scenario.seeds) > 1)}"
            raise ScenarioError(
                f"expect: {expectation.text!r}: the scenario has {there}; valid is 'over' so many at most"
            )
    check_judged(scenario)
    if len(set(scenario.seeds)) < len(scenario.seeds):
        raise ScenarioError(f"seeds: {list(scenario.seeds)} holds one twice; valid are seeds that differ")
    if both := sorted({*scenario.seeds} & {*scenario.training_seeds}):
        raise ScenarioError(
            f"seeds: {both} are among training_seeds {list(scenario.training_seeds)}; valid are others, on which no "
            "parameter was chosen"
        )
    check_drawn(case)
    check_drives_apart(case)
    check_chosen_elsewhere(case)
    for side in case.sides:
        with named(side):
            source = case.source(side, scenario.seeds[0])
            key = f"{side == 'query'} {source} {scenario.localise.sensors}"
            if isinstance(source, Drive) and key not in checked:
                check_drive(source, scenario.localise.sensors)
                if side != "query":
                    check_learnable(source)
                checked.add(key)
    query = case.source("query", scenario.seeds[0])
    if isinstance(scenario, Scenario) and isinstance(query, Drive):
        with named("localise.signal_faults"):
            check_signal_faults(query, scenario.localise.signal_faults, scenario.localise.sensors)
    schema_type.check(scenario, case.file, case.sources(scenario.seeds[0])[:-1])
