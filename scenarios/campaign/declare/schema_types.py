"""Types of scenarios, localising a drive or carrying out a mission, with the checks of what each may declare.

What is done with a case of each kind: ``refseq_bench.scenarios.campaign.case_types``.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from refseq.map.profile import profile_named
from refseq_bench.scenarios.campaign.declare.drivable import named
from refseq_bench.scenarios.campaign.declare.expectations import Expectation, parse
from refseq_bench.scenarios.campaign.declare.mission_checks import check_leaders, check_mission
from refseq_bench.scenarios.campaign.declare.mission_figures import MISSION_FIGURES
from refseq_bench.scenarios.campaign.declare.schema import Declared, MissionScenario, Scenario
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.by_name import check_methods, is_hindsight
from refseq_bench.sim.drives.recorder import MISSION_EVERY
from refseq_bench.sim.drives.signal_faults import SignalFault


class SchemaType(Protocol):
    """Schema and checks of one type of scenario."""

    name: str
    model: type[Declared]
    not_inherited: tuple[str, ...]
    """Keys that the query does not take over from the reference."""
    query_defaults: Mapping[str, Any]
    """Defaults of the query, where the file does not say."""

    @abstractmethod
    def expectation(self, text: str, scenario: Any) -> Expectation:
        """Read an expectation of a scenario. Raises ``ScenarioError``."""

    @abstractmethod
    def check_methods(self, scenario: Any) -> None:
        """Raise the rooms' own errors for a method that there is not."""

    @abstractmethod
    def check_names(self, names: Sequence[str]) -> None:
        """Raise ``ScenarioError`` for a method that a user names and that no scenario of this kind can ask."""

    @abstractmethod
    def summary_lines(self, scenario: Any) -> list[str]:
        """Lines about keys that only this type has."""

    @abstractmethod
    def check(self, scenario: Any, file: Path, references: Sequence[Source]) -> None:
        """Raise the rooms' own errors for what cannot be done; ``file`` is the scenario's."""


class LocalisingSchema(SchemaType):
    """A query is driven, and methods are asked where the robot was."""

    name = "localising"
    model = Scenario
    not_inherited = ("faults",)
    query_defaults: Mapping[str, Any] = MappingProxyType({})

    def expectation(self, text: str, scenario: Scenario) -> Expectation:
        """Of the figures of answers."""
        return parse(text, scenario.localise.profile)

    def check_methods(self, scenario: Scenario) -> None:
        """Localisers only."""
        profile_named(scenario.localise.profile)
        with named("localise"):
            check_methods(scenario.methods)

    def check_names(self, names: Sequence[str]) -> None:
        """Localisers only."""
        check_methods(names)

    def summary_lines(self, scenario: Scenario) -> list[str]:
        """The faults of signals, and the tolerances."""
        terms = scenario.score
        tolerance = f"within {terms.within:g} m and {terms.heading:g} degrees"
        return [
            *(f"  fault of signals: {_in_words(fault)}" for fault in scenario.localise.signal_faults),
            f"  right: {tolerance}; told beside it: {terms.narrow:g} m",
        ]

    def check(self, scenario: Scenario, file: Path, references: Sequence[Source]) -> None:
        """Refuse what is not done with several references."""
        if not scenario.further:
            return
        if scenario.localise.places is not None:
            raise ScenarioError(
                f"localise.places = {scenario.localise.places!r}; valid with [[further]] is to learn all"
            )
        for method in filter(is_hindsight, scenario.methods):
            raise ScenarioError(f"localise: {method!r} knows one reference only; valid are methods without hindsight")


class MissionSchema(SchemaType):
    """The robot is set down, and methods lead it."""

    name = "mission"
    model = MissionScenario
    not_inherited = ("faults", "behaviours", "trigger")
    query_defaults: Mapping[str, Any] = MappingProxyType({"trigger": {"distance": MISSION_EVERY}})

    def expectation(self, text: str, scenario: MissionScenario) -> Expectation:
        """Of the figures of missions."""
        return parse(text, None, MISSION_FIGURES)

    def check_methods(self, scenario: MissionScenario) -> None:
        """Localisers, and those that need none."""
        check_leaders(scenario.methods, programmed=scenario.mission.lamp is not None)

    def check_names(self, names: Sequence[str]) -> None:
        """Localisers, and those that need none; whether there is a program, each scenario tells."""
        check_leaders(names, programmed=True)

    def summary_lines(self, scenario: MissionScenario) -> list[str]:
        """The mission, and when it counts as completed."""
        said = scenario.mission.model_dump(mode="json", exclude_defaults=True)
        terms = scenario.score
        return [
            *(f"  mission, {key}: {value}" for key, value in said.items()),
            f"  completed: within {terms.within:g} m of the goal; told beside it: {terms.narrow:g} m",
        ]

    def check(self, scenario: MissionScenario, file: Path, references: Sequence[Source]) -> None:
        """Refuse what cannot be a mission."""
        check_mission(scenario, file, references)


def _in_words(fault: SignalFault) -> str:
    """A fault's kind, and all of it that is not as it is by default."""
    told = ((field, getattr(fault, field.name)) for field in fields(fault) if field.name != "kind")
    return ", ".join([fault.kind, *(f"{field.name} {value}" for field, value in told if value != field.default)])


LOCALISING, MISSIONS = LocalisingSchema(), MissionSchema()


def schema_type_of(table: Mapping[str, Any]) -> SchemaType:
    """The kind of a file's table, by the table that only missions have."""
    return MISSIONS if "mission" in table else LOCALISING


def schema_type_for(scenario: Declared) -> SchemaType:
    """The kind of a scenario."""
    return MISSIONS if isinstance(scenario, MissionScenario) else LOCALISING
