"""A robot in a world that a program outside drives, over its serial line."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from refseq.access.policy import LOOPBACK
from refseq_bench import robots
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.serial_port import TERMINAL, open_port, serve
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.realtime import RealTimePacer
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan


@dataclass(frozen=True, slots=True)
class Service:
    """Where a robot stands and how it is reached: at a TCP ``port`` of this machine, or None, at a pseudo-terminal.

    ``seconds`` of simulated time, None: without end; ``rate`` is simulated over real time.
    """

    robot: str
    world: str
    route: str
    port: int | None
    seconds: float | None
    rate: float
    seed: int

    def __post_init__(self) -> None:
        if self.seconds is not None and not (math.isfinite(self.seconds) and self.seconds > 0):
            raise ScenarioError(f"seconds {self.seconds:g} is not valid; it should be a time above 0")


@contextmanager
def serving(asked: Service) -> Iterator[tuple[str, Callable[[], None]]]:
    """Open the line; gives its address and what runs the simulation until its time is over."""
    world = build_world(load_plan(asked.world), light_named("16:00"), pictured=False)
    settings = BenchSettings(renderer=RendererKind.NONE, cameras=())
    address = TERMINAL if asked.port is None else f"{LOOPBACK}:{asked.port}"
    with (
        Bench(world, robots.load(asked.robot), route=asked.route, seed=asked.seed, settings=settings) as bench,
        open_port(bench, address) as port,
    ):
        pace = RealTimePacer(asked.rate)

        def run() -> None:
            serve(bench, port, asked.seconds or math.inf, pace)

        yield port.address, run
