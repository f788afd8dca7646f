"""LAMP programs (Fig. 1.6) from files, their runs in a world, and plans of these."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.text_file import TextFileError, read_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from refseq.missions.lamp import LampStage
    from refseq_bench.scenarios.robot_checks.behaviour_drive import BehaviourResult

ON_THE_SPOT = 0.2
"""A stage of a shorter way than this [m] has its number where the robot's tail is in the end, not on its way."""
TAIL = 0.5
SUFFIX = ".lamp"


@dataclass(frozen=True, slots=True)
class LampRun:
    """A program that a robot is to run in a world, from the start of a ``route``."""

    stages: "tuple[LampStage, ...]"
    world: str
    robot: str
    route: str
    seed: int
    timeout: float


def read_program(path: Path) -> "tuple[LampStage, ...]":
    """Read a program from a file, or the library's of that name.

    Raises ``ScenarioError`` for a file that cannot be read, ``MissionError`` for what is no program in it.
    """
    from refseq.missions.lamp import parse_lamp
    from refseq.missions.language import MissionError

    ours = LIBRARY / path.name
    if path.suffix != SUFFIX:
        raise ScenarioError(f"{path}: is no LAMP program; valid is a file ending in {SUFFIX}, such as fig-1.6{SUFFIX}")
    chosen = ours if path == Path(path.name) and ours.is_file() and not path.is_file() else path
    try:
        text = read_text(chosen)
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid is a file such as fig-1.6{SUFFIX}") from None
    try:
        return parse_lamp(text)
    except MissionError as error:
        raise MissionError(f"{path}: {error}") from None


def run_in_world(asked: LampRun) -> "Sequence[BehaviourResult]":
    """Run the program; what became of its stages, up to the first that failed."""
    from refseq_bench import robots
    from refseq_bench.robots.stops import StopLog
    from refseq_bench.scenarios.robot_checks.behaviour_drive import BehaviourResult
    from refseq_bench.sim.bench.bench import Bench
    from refseq_bench.sim.bench.settings import BenchSettings
    from refseq_bench.sim.missions.lamp import run_lamp
    from refseq_bench.sim.rendering.renderer import RendererKind
    from refseq_bench.worlds.build import build_world
    from refseq_bench.worlds.light import light_named
    from refseq_bench.worlds.plans.load import load_plan

    robot, plan = robots.load(asked.robot), load_plan(asked.world)
    settings = BenchSettings(renderer=RendererKind.NONE, cameras=())
    stops = StopLog()
    world = build_world(plan, light_named("16:00"), pictured=False)
    with Bench(world, robot, route=asked.route, seed=asked.seed, settings=settings) as bench:
        ended = run_lamp(bench, asked.stages, timeout=asked.timeout, each=lambda _: stops.hear(bench.state.stops))
    found, time = [], 0.0
    for number, one in enumerate(ended.stages, 1):
        done = one.end
        since, time = time, time + done.time
        held = tuple(stop for stop in stops.heard if since <= stop.since < time)
        found.append(BehaviourResult(f"{number}. {one.stage}", done.outcome, done.why, done.time, done.path, held))
    return found


def lamp_plan(asked: LampRun, found: "Sequence[BehaviourResult]") -> "Figure":
    """Draw the true path on the plan, a colour for each stage and its number beside it."""
    import matplotlib as mpl
    import numpy as np

    from refseq_bench.scenarios.robot_checks.behaviour_drive import BehaviourDrive
    from refseq_bench.scenarios.robot_checks.behaviour_picture import behaviour_plan

    figure = behaviour_plan(BehaviourDrive(asked.robot, tuple(done.text for done in found), asked.world), found)
    width, height = figure.get_size_inches()
    figure.set_size_inches(width + 4.0, height)
    (below,), (axes,) = figure.legends, figure.axes
    handles = [handle for handle in below.legend_handles if handle is not None]
    texts = [text.get_text() for text in below.get_texts()]
    below.remove()
    with mpl.rc_context({**AS_WRITTEN, "font.size": 9, "svg.fonttype": "none"}):
        figure.legend(handles, texts, loc="outside right upper", frameon=False)
        for number, done in enumerate(found, 1):
            x, y, heading = done.path[-1]
            at = (x, y) - TAIL * np.array([np.cos(heading), np.sin(heading)])
            if done.way > ON_THE_SPOT:
                at = done.path[len(done.path) // 2, :2]
            box = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "#222222", "linewidth": 0.6}
            axes.annotate(str(number), tuple(at), ha="center", va="center", bbox=box, zorder=5)
    return figure
