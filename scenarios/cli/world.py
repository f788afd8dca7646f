"""The commands ``refseq world list | show | check | draw | contact-sheet | lux | day | generate``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out, print_json, saved
from refseq_bench.scenarios.cli.terminal.options import (
    CHANGE,
    LIGHT,
    ROBOT,
    ROUTE,
    WORLD_HELP,
    Along,
    Json,
    World,
    defaulting,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import PICTURE, PLAN, output_file
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_new, check_output, writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq_bench.worlds.light import LightSetting

FOUND = 1

app = group("List, check, draw and measure the worlds to drive in.")

Picture = Annotated[Path, PICTURE]
Route = Annotated[str, ROUTE]


@app.command("list", cls=BenchCommand, epilog="Example: `refseq world list --json`")
def list_worlds(as_json: Json = False) -> None:
    """List the worlds of the library."""
    from refseq_bench.scenarios.world_survey.library import library, library_table

    if as_json:
        print_json(library())
    else:
        out.print(library_table())


@app.command(cls=BenchCommand, epilog="Example: `refseq world show hallway`")
def show(world: World, as_json: Json = False) -> None:
    """Describe one world; with --json, its floor plan."""
    from refseq_bench.scenarios.world_survey.facts import world_table
    from refseq_bench.worlds.plans.load import load_plan

    plan = load_plan(world)
    if as_json:
        print_json(plan.model_dump(mode="json"))
    else:
        out.print(world_table(plan))


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world check hallway annex`
* `refseq world check my.toml`

Exit codes: 0 nothing found; 1 something found, one line each; 2 the plan cannot be read.""",
)
def check(
    names: Annotated[list[str], typer.Argument(metavar="WORLD", help=WORLD_HELP)],
) -> None:
    """Build worlds and look for things that stand in each other or in a robot's way."""
    from refseq_bench.scenarios.world_survey.facts import robot_boxes
    from refseq_bench.worlds.check import check_world
    from refseq_bench.worlds.light import light_named
    from refseq_bench.worlds.plans.load import load_plan

    plans = {name: load_plan(name) for name in names}
    boxes, count = robot_boxes(), 0
    for name, plan in plans.items():
        checkup = check_world(plan, light_named("16:00"), boxes)
        costs = f"{checkup.seconds:.1f} s, {checkup.megabytes:.0f} MB, {checkup.geoms} geoms, {checkup.solids} solid"
        more = f" and {checkup.more} more" if checkup.more else ""
        say(out, f"{name}: {costs}: {len(checkup.findings) or 'nothing'}{more} found")
        for finding in checkup.findings:
            say(out, f"{name}: {finding}")
        if more:
            say(out, f"{name}:{more}, which are not told")
        count += len(checkup.findings)
    if count:
        raise typer.Exit(FOUND)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world draw hallway -o hallway.svg`
* `refseq world draw annex --light 18:00 --route detour -o annex.png`""",
)
def draw(
    world: World,
    output: Picture,
    light: Annotated[str | None, defaulting(LIGHT, "no sun is drawn")] = None,
    route: Annotated[
        list[str] | None, option("ROUTE", "Route to draw; may be repeated. [default: the first four]")
    ] = None,
) -> None:
    """Draw the plan of a world, with a scale, north and the sun."""
    from refseq_bench.worlds.light import light_named
    from refseq_bench.worlds.plans.load import load_plan

    plan, setting = load_plan(world), light_named(light) if light else None

    from refseq_bench.worlds.drawing.draw import draw_plan

    with saved(output) as temporary:
        draw_plan(plan, temporary, setting, route)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world contact-sheet hallway -o sheet.png`
* `refseq world contact-sheet car-park --light 09:00 --light overcast --along 40 --change busy -o sheet.png`""",
)
def contact_sheet(
    world: World,
    output: Picture,
    light: Annotated[
        list[str] | None,
        option("LIGHT", "Light of a column; may be repeated. [default: 09:00, 13:00, 18:00, late-evening]"),
    ] = None,
    along: Along = None,
    route: Route = "forward",
    change: Annotated[str, CHANGE] = "none",
    robot: Annotated[str, ROBOT] = "robuter",
) -> None:
    """Show what a robot's cameras see at places along a route, in several lights side by side."""
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.world_survey.snapshots import places_on, snapshots
    from refseq_bench.worlds.light import light_named

    check_output(output)
    lights = tuple(dict.fromkeys(light or ("09:00", "13:00", "18:00", "late-evening")))
    for name in lights:
        light_named(name)
    drive = Drive(world=world, route=route, change=change, robot=robot)
    pictures = list(snapshots(drive, lights, places_on(drive, along)))

    from refseq_bench.scenarios.world_survey.contact_sheet import contact_sheet as drawn

    with saved(output) as temporary:
        drawn(f"{world}, {route}", pictures).savefig(temporary)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world lux hallway --at 12.5,0,1 --light 18:00`
* `refseq world lux hallway --at 12.5,0,0 --at 16,0,0 --facing 0,1,0 --light 18:00,cloud=0.5`""",
)
def lux(
    world: World,
    at: Annotated[list[str], option("X,Y,Z", "Point to measure at [m]; may be repeated.")],
    facing: Annotated[str, option("DIRECTION", "Direction that the meter faces: up, down or X,Y,Z.")] = "up",
    light: Annotated[str, LIGHT] = "16:00",
    as_json: Json = False,
) -> None:
    """Measure how light it is at points, and where the light comes from."""
    from refseq_bench.scenarios.world_survey.facts import direction, lux_table, point_in, sun_text
    from refseq_bench.worlds.light import light_named
    from refseq_bench.worlds.meter import Meter
    from refseq_bench.worlds.plans.load import load_plan

    plan, setting, normal = load_plan(world), light_named(light), direction(facing)
    points = {text: point_in(plan, text) for text in at}
    meter = Meter(plan, setting)
    readings = [(text, meter.read(point, normal)) for text, point in points.items()]
    if as_json:
        print_json([{"at_m": points[text], "lux": reading} for text, reading in readings])
        return
    say(out, f"{plan.name} at {sun_text(plan, setting)}; the meter faces {facing}")
    out.print(lux_table(readings))


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world day hallway -o day.png`
* `refseq world day hallway --light 12:00 --conditions cloud=1,date=2008-12-21 --step 30 -o december.png`""",
)
def day(
    world: World,
    output: Picture,
    light: Annotated[str, LIGHT] = "16:00",
    first_hour: Annotated[int, option("HOUR", "Hour to begin at.", min=0, max=24)] = 6,
    last_hour: Annotated[int, option("HOUR", "Hour to end at.", min=0, max=24)] = 23,
    step: Annotated[int, option("MINUTES", "Time from one picture to the next.", min=1)] = 60,
    conditions: Annotated[str, option("TEXT", "Conditions at every hour: cloud=1,lamps=off.")] = "",
    along: Along = None,
    route: Route = "forward",
) -> None:
    """Tell how many SIFT keys of a picture in one light are found again at the hours of a day, and how light it is."""
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.world_survey.day import Day, day_table, through_the_day
    from refseq_bench.scenarios.world_survey.snapshots import places_on
    from refseq_bench.worlds.light import light_named

    check_output(output)
    lights = _lights(first_hour, last_hour, step, conditions)
    drive = Drive(world=world, light=light_named(light).name, route=route)
    hours = through_the_day(Day(drive, lights, places_on(drive, along)))

    from refseq_bench.scenarios.world_survey.day_curve import day_curve

    with saved(output) as temporary:
        day_curve(f"{world}: SIFT keys of {light} found again", hours).savefig(temporary)
        out.print(day_table(hours))


def _lights(first: int, last: int, step: int, conditions: str) -> "tuple[LightSetting, ...]":
    """The lights from one hour to another. Raises ``ScenarioError`` where there is none between."""
    from refseq_bench.worlds.light import clock_text, light_named

    clock = [clock_text(minute / 60) for minute in range(60 * first, 60 * last + 1, step)]
    if not clock:
        raise ScenarioError(
            f"--first-hour {first} --last-hour {last}: no hour lies between; valid is a last hour that is not before "
            "the first"
        )
    return tuple(light_named(",".join(filter(None, (hour, conditions)))) for hour in clock)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq world generate building:5,texture=0.3 -o mine.toml`
* `refseq world generate hallway -o mine.toml`
* `refseq world generate --seed 7 -o mine.toml`""",
)
def generate(
    output: Annotated[Path, output_file(PLAN, "Plan to write")],
    world: Annotated[
        str | None,
        typer.Argument(metavar="WORLD", help=f"{WORLD_HELP} [default: corridor:SEED]", show_default=False),
    ] = None,
    seed: Annotated[int | None, option("N", "Seed of a corridor, instead of WORLD. [default: 1]", min=0)] = None,
) -> None:
    """Write the plan of a world as a file, to look at and go on with."""
    from refseq.files import replace_text
    from refseq_bench.worlds.plans.load import load_plan
    from refseq_bench.worlds.plans.write import plan_text

    check_new(output)
    if world is not None and seed is not None:
        raise ScenarioError(f"--seed {seed} is that of a corridor; valid is WORLD or --seed, not both")
    name = world or f"corridor:{1 if seed is None else seed}"
    plan = load_plan(name)
    with writing(output):
        replace_text(output, plan_text(plan, f"Made by: refseq world generate {name}"))
    say(out, f"{output}: {plan.title}")
