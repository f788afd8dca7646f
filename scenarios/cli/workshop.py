"""The commands ``refseq demo`` and ``refseq doctor``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.bars import step_bars
from refseq_bench.scenarios.cli.terminal.console import leave_any_below, out, print_json, print_results
from refseq_bench.scenarios.cli.terminal.options import (
    DEFAULT_RENDERER_NAME,
    LIGHT,
    RENDERER,
    ROBOT,
    WORLD,
    AtLeast,
    Json,
    Profile,
    RendererName,
    flag,
    option,
    output,
)
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq_bench.scenarios.drives.evaluate import StageResult

DEMO_HELP = """Examples:

* `refseq demo`
* `refseq demo --query-light 18:00 --query-light late-evening --runs 5 -o out/five`

Exit codes: 0 done; 1 in one of the lights it is right less often than `--at-least`; 2 bad input."""
DOCTOR_HELP = """Examples:

* `refseq doctor`
* `refseq doctor --frame-rates`

Exit codes: 0 the demo can run; 1 something that it needs is missing."""


def demo(
    output: Annotated[Path, output("Folder to fill.", "FOLDER")] = Path("out/demo"),
    world: Annotated[str, WORLD] = "hallway",
    light: Annotated[str, LIGHT] = "16:00",
    query_light: Annotated[
        list[str] | None, option("LIGHT", "Light of the later drive; may be repeated. [default: 18:00]")
    ] = None,
    runs: Annotated[int, option("N", "Pairs of drives, with seeds 1 to N.", min=1)] = 1,
    robot: Annotated[str, ROBOT] = "robuter",
    renderer: Annotated[RendererName, RENDERER] = DEFAULT_RENDERER_NAME,
    profile: Profile = "thesis",
    at_least: AtLeast = None,
) -> None:
    """Record two drives, learn, localise and report, all at once."""
    from refseq.map.profile import profile_named
    from refseq_bench.scenarios.drives.inputs import check_folder
    from refseq_bench.worlds.light import light_named

    lights, chosen = tuple(dict.fromkeys(query_light or ["18:00"])), profile_named(profile)
    for name in (light, *lights):
        light_named(name)  # a name that is wrong is told before the first drive, not after it
    check_folder(output)

    from refseq_bench.scenarios.cli.demo import Demo, run_demo
    from refseq_bench.scenarios.cli.terminal.screen import rerun_command
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.evaluate import results
    from refseq_bench.sim.rendering.renderer import RendererKind

    first = Drive(world=world, light=light, robot=robot, renderer=RendererKind(renderer.value))
    with step_bars() as step:
        comparisons = run_demo(Demo(first, lights, tuple(range(1, runs + 1)), chosen), output, step)
    found: dict[str, list[StageResult]] = {}
    for name in dict.fromkeys(comparison.name for comparison in comparisons):
        same = [comparison for comparison in comparisons if comparison.name == name]
        found[name] = results(same)
        print_results(f"{world}, {name}", found[name], same)
    say(out, f"look at {output / 'report.html'}, and: {rerun_command(output / 'demo.rrd')}")
    leave_any_below(found, at_least)


def doctor(
    frame_rates: Annotated[
        bool, flag("--frame-rates", "Time pictures of the hallway by each renderer, too: half a minute.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Tell what this machine lacks for the bench, and how to mend it."""
    from refseq_bench.scenarios.cli.doctor import checks, report

    if not as_json:
        raise typer.Exit(report(out, frames=frame_rates))
    found = checks(frames=frame_rates)
    print_json(found)
    raise typer.Exit(int(any(check.needed and not check.ok for check in found)))
