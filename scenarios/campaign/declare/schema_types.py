"""Types of scenarios, localising a drive or carrying out a mission: schema, defaults, figures.

Checks of each type: ``refseq_bench.scenarios.campaign.declare.checks.by_type``. Work on cases of each type:
``refseq_bench.scenarios.campaign.case_types``.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, Protocol

from refseq_bench.scenarios.campaign.declare.expectations import Expectation, parse
from refseq_bench.scenarios.campaign.declare.mission_figures import MISSION_FIGURES
from refseq_bench.scenarios.campaign.declare.schema import Declared, MissionScenario, Scenario
from refseq_bench.sim.drives.signal_faults import SignalFault
from refseq_bench.sim.drives.view_spacing import MISSION_EVERY


class SchemaType(Protocol):
    """Schema of one type of scenario."""

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
    def summary_lines(self, scenario: Any) -> list[str]:
        """Lines about keys that only this type has."""


class LocalisingSchema(SchemaType):
    """A query is driven, and methods are asked where the robot was."""

    name = "localising"
    model = Scenario
    not_inherited = ("faults",)
    query_defaults: Mapping[str, Any] = MappingProxyType({})

    def expectation(self, text: str, scenario: Scenario) -> Expectation:
        """Of the figures of answers."""
        return parse(text, scenario.localise.profile)

    def summary_lines(self, scenario: Scenario) -> list[str]:
        """The faults of signals, and the tolerances."""
        terms = scenario.score
        tolerance = f"within {terms.within:g} m and {terms.heading:g} degrees"
        return [
            *(f"  fault of signals: {_in_words(fault)}" for fault in scenario.localise.signal_faults),
            f"  right: {tolerance}; told beside it: {terms.narrow:g} m",
        ]


class MissionSchema(SchemaType):
    """The robot is set down, and methods lead it."""

    name = "mission"
    model = MissionScenario
    not_inherited = ("faults", "behaviours", "trigger")
    query_defaults: Mapping[str, Any] = MappingProxyType({"trigger": {"distance": MISSION_EVERY}})

    def expectation(self, text: str, scenario: MissionScenario) -> Expectation:
        """Of the figures of missions."""
        return parse(text, None, MISSION_FIGURES)

    def summary_lines(self, scenario: MissionScenario) -> list[str]:
        """The mission, and when it counts as completed."""
        said = scenario.mission.model_dump(mode="json", exclude_defaults=True)
        terms = scenario.score
        return [
            *(f"  mission, {key}: {value}" for key, value in said.items()),
            f"  completed: within {terms.within:g} m of the goal; told beside it: {terms.narrow:g} m",
        ]


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
