"""Dials of a scenario that a search may turn: light, world, change, operator, robot, start; each over a valid range."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from refseq.view import LASER
from refseq_bench.robots.individual import SPREADS
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.checks.drivable import check_route
from refseq_bench.scenarios.campaign.declare.overrides import with_sources
from refseq_bench.scenarios.campaign.declare.schema import DriveTable
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.change.change import change_named
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.dials import RANGES

Value = float | str
Point = Mapping[str, Value]
"""Values of dials by their names; a dial that is not named is as the scenario's file has it."""
FIRST_HOUR, LAST_HOUR = 6.0, 22.0
"""Hours that are sought [h]; in the night before and after, nothing changes any more."""
SHORTEST = 8.0
"""Way that is left to the query where it starts later [m]."""
CHANGES = ("people", "walkers", "doors", "bins", "furniture", "posters")
"""Changes of indoor worlds."""


@dataclass(frozen=True)
class Scale:
    """A number, from ``least`` to ``greatest`` by steps; ``put`` turns a case's dial.

    ``easy`` is its value in the scenario's file, None where the world's seed draws it.
    """

    name: str
    easy: float | None
    put: Callable[[Case, Any], Case]
    least: float
    greatest: float
    step: float

    @property
    def values(self) -> Sequence[float]:
        """All values, rising."""
        count = int((self.greatest - self.least) / self.step + 1e-6)
        return [round(self.least + k * self.step, 6) for k in range(count + 1)]

    def within(self, text: str) -> "Scale":
        """The same over FROM:TO only. Raises ``ScenarioError``."""
        try:
            low, high = (float(part) for part in text.split(":"))
        except ValueError:
            low, high = 1.0, 0.0
        if not self.least <= low < high <= self.greatest:
            raise ScenarioError(
                f"--dial {self.name}={text} is not valid; it should be FROM:TO, rising, from {self.least:g} to "
                f"{self.greatest:g}"
            )
        return replace(self, least=low, greatest=high)


@dataclass(frozen=True)
class Choice:
    """One of a few words; ``easy`` is that of the scenario's file, ``put`` turns a case's dial."""

    name: str
    easy: str
    put: Callable[[Case, Any], Case]
    words: tuple[str, ...]

    @property
    def values(self) -> Sequence[str]:
        """All words."""
        return self.words


Dial = Scale | Choice
NAMES = ("hour", "cloud", *RANGES, *CHANGES, "operator", "style", "side", "start", "spread")
"""All dials that some scenario has."""


def dials_of(case: Case) -> dict[str, Dial]:
    """The dials that a scenario has. Raises ``ScenarioError`` for one that is not of drives to simulate."""
    reference, query = case.scenario.reference, case.scenario.query
    tables = (*case.scenario.references, query)
    if not isinstance(reference, DriveTable) or not isinstance(query, DriveTable) or hasattr(case.scenario, "mission"):
        raise ScenarioError(
            f"{case.name}: is no scenario of simulated drives and localising; valid for a search are those alone"
        )
    if not all(isinstance(one, DriveTable) for one in tables):
        raise ScenarioError(f"{case.name}: a reference is no simulated drive; valid for a search are those alone")
    found = [*_light(case, query), *_world(reference, query), *_change(query), *_driven(case, reference, query)]
    return {dial.name: dial for dial in found}


def selected_dials(case: Case, wanted: Sequence[str]) -> dict[str, Dial]:
    """The dials that are named, as NAME or NAME=FROM:TO; none: all. Raises ``ScenarioError`` for what there is not."""
    there = dials_of(case)
    found: dict[str, Dial] = {}
    for text in wanted:
        name, within, limits = text.partition("=")
        if name not in there:
            known = f"{case.name} has no such dial" if name in NAMES else f"{name!r} is no dial"
            raise ScenarioError(f"--dial {text!r}: {known}; valid are {', '.join(there)}")
        if name in found:
            raise ScenarioError(f"--dial {text!r}: {name} is named twice; valid is once")
        dial = there[name]
        if within and not isinstance(dial, Scale):
            raise ScenarioError(
                f"--dial {text!r}: {name} has no range; valid is {name}, for {', '.join(map(str, dial.values))}"
            )
        found[name] = dial.within(limits) if within and isinstance(dial, Scale) else dial
    return found or there


def at_point(case: Case, dials: Mapping[str, Dial], point: Point) -> Case:
    """The case with its dials turned."""
    for name, value in point.items():
        case = dials[name].put(case, value)
    return case


# --- each of them ---


def sees(case: Case) -> bool:
    """True where a camera takes pictures that some method is given."""
    sensors, query = case.scenario.localise.sensors, case.scenario.query
    rendered = isinstance(query, DriveTable) and query.renderer is not RendererKind.NONE
    return rendered and (sensors is None or any(name != LASER for name in sensors))


def _light(case: Case, query: DriveTable) -> Iterator[Dial]:
    if not sees(case):
        return
    light = light_named(query.light)
    yield Scale("hour", light.hour, _put_hour, FIRST_HOUR, LAST_HOUR, 0.25)
    yield Scale("cloud", light.cloud, _put_cloud, 0.0, 1.0, 0.1)


def _put_hour(case: Case, hour: float) -> Case:
    return _with_light(case, hour=hour)


def _put_cloud(case: Case, cloud: float) -> Case:
    return _with_light(case, cloud=cloud)


def _with_light(case: Case, **changed: float) -> Case:
    query = _query(case)
    light = replace(light_named(query.light), **changed)  # type: ignore[arg-type]
    return _with_query(case, light=light.as_text())


def _world(reference: DriveTable, query: DriveTable) -> Iterator[Dial]:
    """Dials behind a generated world's seed, where both drives are in one."""
    if reference.world != query.world or not query.world.startswith(("building:", "corridor:")):
        return
    turned = _turned(query.world)
    steps = {"texture": 0.05, "width": 0.1}
    for name, (least, greatest) in RANGES.items():
        easy = float(turned[name]) if name in turned else None
        yield Scale(name, easy, partial(_put_world, name), least, greatest, steps.get(name, 0.1))


def _turned(world: str) -> dict[str, str]:
    _, _, words = world.partition(",")
    return dict(word.split("=", 1) for word in words.split(",") if word)


def _put_world(name: str, case: Case, value: float) -> Case:
    def turned(table: Any) -> Any:
        seed, _, _ = table.world.partition(",")
        dials = {**_turned(table.world), name: f"{value:g}"}
        world = ",".join((seed, *(f"{key}={text}" for key, text in dials.items())))
        return table.model_copy(update={"world": world})

    return with_sources(case, turned)


def _change(query: DriveTable) -> Iterator[Dial]:
    change = change_named(query.change)
    for kind in CHANGES:
        yield Scale(kind, getattr(change, kind), partial(_put_change, kind), 0.0, 1.0, 0.1)


def _put_change(kind: str, case: Case, value: float) -> Case:
    change = replace(change_named(_query(case).change), **{kind: value})
    return _with_query(case, change=change.as_text())


def _driven(case: Case, reference: DriveTable, query: DriveTable) -> Iterator[Dial]:
    """The robot and who leads it; nobody leads one that runs behaviours."""
    if not (query.behaviours or reference.behaviours):
        yield Scale("operator", query.operator, partial(_put_query, "operator"), 0.0, 3.0, 0.25)
        yield Choice("style", query.operator_style, partial(_put_query, "operator_style"), ("careful", "weaving"))
        yield Scale("side", query.side, partial(_put_query, "side"), -0.5, 0.5, 0.1)
        drive = case.source("query", case.scenario.seeds[0])
        assert isinstance(drive, Drive)
        farthest = float(int(query.start + check_route(drive) - SHORTEST))
        if farthest >= query.start + 1.0:
            yield Scale("start", query.start, partial(_put_query, "start"), query.start, farthest, 1.0)
    yield Choice("spread", query.robot_spread, _put_spread, tuple(SPREADS))


def _put_query(key: str, case: Case, value: Value) -> Case:
    return _with_query(case, **{key: value})


def _put_spread(case: Case, spread: str) -> Case:
    scenario = case.scenario
    reference = scenario.reference.model_copy(update={"robot_spread": spread})
    further = tuple(one.model_copy(update={"robot_spread": spread}) for one in scenario.further)
    changed = scenario.model_copy(update={"reference": reference, "further": further})
    return _with_query(replace(case, scenario=changed), robot_spread=spread)


def _query(case: Case) -> DriveTable:
    query = case.scenario.query
    assert isinstance(query, DriveTable)
    return query


def _with_query(case: Case, **changed: object) -> Case:
    query = _query(case).model_copy(update=changed)
    return replace(case, scenario=case.scenario.model_copy(update={"query": query}))
