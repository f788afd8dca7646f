"""Checks of what a scenario of each type may declare: methods, references, missions."""

from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from refseq_bench.scenarios.campaign.declare.checks.missions import check_leaders, check_mission
from refseq_bench.scenarios.campaign.declare.schema import Declared, MissionScenario, Scenario
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.errors import ScenarioError, named
from refseq_bench.scenarios.methods.checks import check_methods, check_profile
from refseq_bench.scenarios.methods.names import is_hindsight


class TypeChecks(Protocol):
    """Checks of one type of scenario."""

    @abstractmethod
    def check_methods(self, scenario: Any) -> None:
        """Raise the rooms' own errors for a method that there is not."""

    @abstractmethod
    def check_names(self, names: Sequence[str]) -> None:
        """Raise ``ScenarioError`` for a method that a user names and that no scenario of this type can ask."""

    @abstractmethod
    def check(self, scenario: Any, file: Path, references: Sequence[Source]) -> None:
        """Raise the rooms' own errors for what cannot be done; ``file`` is the scenario's."""


class LocalisingChecks(TypeChecks):
    """A query is driven, and methods are asked where the robot was."""

    def check_methods(self, scenario: Scenario) -> None:
        """Localisers only."""
        check_profile(scenario.localise.profile)
        with named("localise"):
            check_methods(scenario.methods)

    def check_names(self, names: Sequence[str]) -> None:
        """Localisers only."""
        check_methods(names)

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


class MissionChecks(TypeChecks):
    """The robot is set down, and methods lead it."""

    def check_methods(self, scenario: MissionScenario) -> None:
        """Localisers, and those that need none."""
        check_leaders(scenario.methods, programmed=scenario.mission.lamp is not None)

    def check_names(self, names: Sequence[str]) -> None:
        """Localisers, and those that need none; whether there is a program, each scenario tells."""
        check_leaders(names, programmed=True)

    def check(self, scenario: MissionScenario, file: Path, references: Sequence[Source]) -> None:
        """Refuse what cannot be a mission."""
        check_mission(scenario, file, references)


LOCALISING, MISSIONS = LocalisingChecks(), MissionChecks()


def checks_for(scenario: Declared) -> TypeChecks:
    """The checks of a scenario's type."""
    return MISSIONS if isinstance(scenario, MissionScenario) else LOCALISING
