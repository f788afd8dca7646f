"""A drive by names, before anything is simulated: world, light, robot, seed.

Whoever only declares drives, as scenarios do, loads no physics with it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from refseq.view import LASER
from refseq_bench.robots.individual import CALIBRATED
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.faults import Fault
from refseq_bench.sim.drives.operator import PATIENCE, OperatorStyle
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.sim.sensors.laser_model import RangeMode

if TYPE_CHECKING:
    from refseq_bench.robots import Robot

QUERY_SEEDS = 1000
"""Added to a reference drive's seed for the query drives: never the same drive twice."""
OWN_ROUTE = "own"
"""Name of the route that a drive brings itself."""


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive to record; equal drives give equal recordings. ``sensors`` None means all that the robot has.

    ``light`` and ``change`` are texts as ``light_named`` and ``change_named`` read them. The change is drawn from
    ``change_seed``, None: the drive's own. ``cameras`` names the model of each camera that is no Fire-i. ``laser``
    tells how far the laser reaches.

    ``waypoints`` [m] are a route of the drive's own, called ``OWN_ROUTE``, in place of one of the world's. Only the
    stretch from ``start`` to ``end`` [m along the route] is driven; None: to its end. ``faults`` happen on the way, by
    metres from where the drive starts. ``patience`` [s, simulated] is how long it may take.

    With ``behaviours``, as ``refseq_bench.robots.behaviours.written`` reads them, nobody leads the robot: from the
    start of the route it runs them one after another.

    ``robot_spread`` is one of ``robots.individual.SPREADS``: with ``as-built`` each seed drives a robot of its own.
    """

    world: str = "hallway"
    light: str = "16:00"
    change: str = "none"
    change_seed: int | None = None
    robot: str = "robuter"
    robot_spread: str = CALIBRATED
    route: str = "forward"
    seed: int = 1
    world_seed: int = 0
    renderer: RendererKind = DEFAULT_RENDERER
    trigger: Trigger = field(default_factory=Trigger)
    style: OperatorStyle = field(default_factory=OperatorStyle)
    sensors: tuple[str, ...] | None = None
    cameras: Mapping[str, str] = field(default_factory=dict)
    laser: RangeMode = RangeMode.METRES_80
    waypoints: tuple[tuple[float, float], ...] = ()
    start: float = 0.0
    end: float | None = None
    faults: tuple[Fault, ...] = ()
    patience: float = PATIENCE
    behaviours: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.behaviours and self.faults:
            raise ScenarioError(
                "faults and behaviours exclude each other: faults happen where somebody leads the robot"
            )
        if self.behaviours and self.style != replace(OperatorStyle(), strength=self.style.strength):
            raise ScenarioError(
                "an operator's style or side and behaviours exclude each other: with behaviours nobody leads the robot"
            )
        if not 0 < self.patience < math.inf:
            raise ScenarioError(f"patience {self.patience} s is not valid; it should be positive")

    @property
    def unit(self) -> int:
        """Number of the individual robot: the bench's one, or where they differ as built, each drive's own."""
        return 1 if self.robot_spread == CALIBRATED else self.seed

    @property
    def route_name(self) -> str:
        """Name of the route in ``plan_of`` the drive: its own where it has waypoints."""
        return OWN_ROUTE if self.waypoints else self.route

    @property
    def day(self) -> int:
        """Seed of what is not as it was."""
        return self.seed if self.change_seed is None else self.change_seed


def name_of_route(drive: Drive) -> str:
    """The route in words, with the stretch of it that is driven."""
    name = drive.route_name
    if not drive.start and drive.end is None:
        return name
    return f"{name} from {drive.start:g} m" + ("" if drive.end is None else f" to {drive.end:g} m")


def check_sensors(wanted: tuple[str, ...], robot: "Robot") -> None:
    """Raise ``ScenarioError`` for a sensor that the robot does not carry, and for one that is named twice."""
    valid = (*robot.cameras, LASER)
    for sensor in wanted:
        if sensor not in valid:
            raise ScenarioError(f"sensor {sensor!r} is not on robot {robot.name!r}; valid are {', '.join(valid)}")
        if wanted.count(sensor) > 1:
            raise ScenarioError(f"sensors: {sensor} is named twice; valid is once")
