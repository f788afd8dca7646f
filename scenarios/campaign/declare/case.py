"""A case of a scenario file, and its sources as they are simulated or read."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from refseq_bench.scenarios.campaign.declare.drive_seeds import added_seeds
from refseq_bench.scenarios.campaign.declare.expand import Values
from refseq_bench.scenarios.campaign.declare.expectations import Expectation
from refseq_bench.scenarios.campaign.declare.schema import Declared, DriveTable, LogTable, SourceTable
from refseq_bench.scenarios.campaign.declare.sources import Images, Log, Source
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.drives.operator import style_named
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.sensors.laser_model import RangeMode

EACH_SEED = "SEED"
"""Stands for the seed in a generated world's name."""


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
