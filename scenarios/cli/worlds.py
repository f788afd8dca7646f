"""The commands ``refseq worlds list | show | check | draw | sheet | lux | day | generate``."""

from pathlib import Path
from typing import Annotated

import typer

from refseq.files import replace_text, replacing_at
from scenarios.cli.console import err, out, say
from scenarios.drives.inputs import check_output, writing
from scenarios.errors import ScenarioError

FOUND = 1

worlds = typer.Typer(
    help="The worlds that robots drive in: what there is, what is wrong with one, what it looks like, how light it is.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)

World = Annotated[
    str, typer.Argument(metavar="WORLD", help="A world of the library, corridor:SEED, or a path ending in .toml.")
]
Picture = Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Picture to write (.svg or .png).")]
Route = Annotated[str, typer.Option(metavar="ROUTE", help="Route of the world along which places are told.")]
Along = Annotated[
    list[float] | None,
    typer.Option(metavar="METRES", help="A place along the route; may be repeated. [default: three, a quarter apart]"),
]
LIGHT_HELP = "A preset or any hour, 17:45, and after it with commas cloud=0..1, lamps=auto|on|off, date=2008-06-15."


@worlds.command("list")
def list_worlds() -> None:
    """List the worlds of the library."""
    from scenarios.world_survey.facts import library_table

    out.print(library_table())


@worlds.command(epilog="Example: `refseq worlds show hallway`")
def show(world: World) -> None:
    """Tell all about one world."""
    from scenarios.world_survey.facts import world_table
    from worlds.plans.load import load_plan

    out.print(world_table(load_plan(world)))


@worlds.command(
    epilog="""Examples:

* `refseq worlds check hallway annex`
* `refseq worlds check my.toml`

Exit codes: 0 nothing found; 1 something found, one line each; 2 the plan cannot be read."""
)
def check(
    names: Annotated[list[str], typer.Argument(metavar="WORLD...", help="Worlds, corridor:SEED, or plans (.toml).")],
) -> None:
    """Put worlds up and look for things that stand in each other or in a robot's way."""
    from scenarios.world_survey.facts import robot_boxes
    from worlds.check import check_world
    from worlds.light import light_named
    from worlds.plans.load import load_plan

    plans = {name: load_plan(name) for name in names}
    boxes, found = robot_boxes(), 0
    for name, plan in plans.items():
        checkup = check_world(plan, light_named("16:00"), boxes)
        costs = f"{checkup.seconds:.1f} s, {checkup.megabytes:.0f} MB, {checkup.geoms} geoms, {checkup.solids} solid"
        say(out, f"{name}: {costs}: {len(checkup.findings) or 'nothing'} found")
        for finding in checkup.findings:
            say(err, f"{name}: {finding}")
        found += len(checkup.findings)
    if found:
        raise typer.Exit(FOUND)


@worlds.command(
    epilog="""Examples:

* `refseq worlds draw hallway -o hallway.svg`
* `refseq worlds draw annex --light 18:00 --route detour -o annex.png`"""
)
def draw(
    world: World,
    output: Picture,
    light: Annotated[str | None, typer.Option(metavar="LIGHT", help=f"Show where the sun stands. {LIGHT_HELP}")] = None,
    route: Annotated[
        list[str] | None,
        typer.Option(metavar="ROUTE", help="Route to draw; may be repeated. [default: the first four]"),
    ] = None,
) -> None:
    """Draw the plan of a world, with a scale and north."""
    from worlds.drawing.draw import check_picture, draw_plan
    from worlds.light import light_named
    from worlds.plans.load import load_plan

    check_picture(output)
    check_output(output)
    plan, setting = load_plan(world), light_named(light) if light else None
    with writing(output), replacing_at(output) as temporary:
        draw_plan(plan, temporary, setting, route)
    say(out, f"{output}")


@worlds.command(
    epilog="""Examples:

* `refseq worlds sheet hallway -o sheet.png`
* `refseq worlds sheet car-park --light 09:00 --light overcast --along 40 --change busy -o sheet.png`"""
)
def sheet(
    world: World,
    output: Picture,
    light: Annotated[
        list[str] | None,
        typer.Option(metavar="LIGHT", help="A column; may be repeated. [default: 09:00, 13:00, 18:00, late-evening]"),
    ] = None,
    along: Along = None,
    route: Route = "forward",
    change: Annotated[
        str, typer.Option(metavar="CHANGE", help="What is not as the plan has it: none, few, busy…")
    ] = "none",
    robot: Annotated[str, typer.Option(metavar="ROBOT", help="Robot whose cameras look.")] = "robuter",
) -> None:
    """Show what a robot's cameras see at places along a route, in several lights side by side."""
    from scenarios.drives.record import Drive
    from scenarios.world_survey.contact_sheet import contact_sheet
    from scenarios.world_survey.snapshots import places_on, snapshots
    from worlds.drawing.draw import check_picture
    from worlds.light import light_named

    check_picture(output)
    check_output(output)
    lights = tuple(dict.fromkeys(light or ("09:00", "13:00", "18:00", "late-evening")))
    for name in lights:
        light_named(name)
    drive = Drive(world=world, route=route, change=change, robot=robot)
    found = list(snapshots(drive, lights, places_on(drive, along)))
    with writing(output), replacing_at(output) as temporary:
        contact_sheet(f"{world}, {route}", found).savefig(temporary)
    say(out, f"{output}")


@worlds.command(
    epilog="""Examples:

* `refseq worlds lux hallway --at 12.5,0,1 --hour 18:00`
* `refseq worlds lux hallway --at 12.5,0,0 --at 16,0,0 --facing 0,1,0 --light 18:00,cloud=0.5`"""
)
def lux(
    world: World,
    at: Annotated[list[str], typer.Option(metavar="X,Y,Z", help="Where to measure [m]; may be repeated.")],
    facing: Annotated[str, typer.Option(metavar="DIRECTION", help="Where the meter faces: up, down or X,Y,Z.")] = "up",
    light: Annotated[str, typer.Option("--light", "--hour", metavar="LIGHT", help=LIGHT_HELP)] = "16:00",
) -> None:
    """Measure how light it is at a point, and where the light comes from."""
    from scenarios.world_survey.facts import direction, lux_table, point_in, sun_text
    from worlds.light import light_named
    from worlds.meter import Meter
    from worlds.plans.load import load_plan

    plan, setting, normal = load_plan(world), light_named(light), direction(facing)
    points = {text: point_in(plan, text) for text in at}
    meter = Meter(plan, setting)
    say(out, f"{plan.name} at {sun_text(plan, setting)}; the meter faces {facing}")
    out.print(lux_table([(text, meter.read(point, normal)) for text, point in points.items()]))


@worlds.command(
    epilog="""Examples:

* `refseq worlds day hallway -o day.png`
* `refseq worlds day hallway --reference 12:00 --with cloud=1,date=2008-12-21 --every 30 -o december.png`"""
)
def day(
    world: World,
    output: Picture,
    reference: Annotated[
        str, typer.Option(metavar="LIGHT", help=f"Light of the pictures looked for. {LIGHT_HELP}")
    ] = "16:00",
    first: Annotated[int, typer.Option("--from", min=0, max=24, metavar="HOUR", help="First hour.")] = 6,
    last: Annotated[int, typer.Option("--to", min=0, max=24, metavar="HOUR", help="Last hour.")] = 23,
    every: Annotated[int, typer.Option(min=1, metavar="MINUTES", help="Time from one picture to the next.")] = 60,
    options: Annotated[
        str, typer.Option("--with", metavar="OPTIONS", help="What goes with every hour: cloud=1,lamps=off.")
    ] = "",
    along: Along = None,
    route: Route = "forward",
) -> None:
    """Tell how many of a picture's SIFT keys are found again at other hours of the day, and how light it is."""
    from scenarios.drives.record import Drive
    from scenarios.world_survey.day import Day, day_curve, day_table, through_the_day
    from scenarios.world_survey.snapshots import places_on
    from worlds.drawing.draw import check_picture
    from worlds.light import light_named

    check_picture(output)
    check_output(output)
    clock = [f"{minute // 60:02d}:{minute % 60:02d}" for minute in range(60 * first, 60 * last + 1, every)]
    if not clock:
        raise ScenarioError(
            f"--from {first} --to {last}: no hour lies between; valid is a last hour that is not before the first"
        )
    lights = [light_named(",".join(filter(None, (hour, options)))) for hour in clock]
    drive = Drive(world=world, light=light_named(reference).name, route=route)
    found = through_the_day(Day(drive, tuple(lights), places_on(drive, along)))
    with writing(output), replacing_at(output) as temporary:
        day_curve(f"{world}: SIFT keys of {reference} found again", found).savefig(temporary)
    out.print(day_table(found))
    say(out, f"{output}")


@worlds.command(epilog="Example: `refseq worlds generate --seed 7 -o mine.toml`")
def generate(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Plan to write (.toml).")],
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the corridor.")] = 1,
) -> None:
    """Write the plan of a new corridor, to look at and go on with; `corridor:N` is the same without a file."""
    from worlds.plans.generate import corridor
    from worlds.plans.write import plan_text

    check_output(output)
    if output.suffix != ".toml":
        raise ScenarioError(f"{output}: is no name of a plan; valid is one that ends in .toml")
    plan = corridor(seed)
    with writing(output):
        replace_text(output, plan_text(plan, f"Made by: refseq worlds generate --seed {seed}"))
    say(out, f"{output}: {plan.title}")
