"""The commands ``refseq module``: the parts of a robot as processes, on one or several hosts."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from refseq.missions.limits import TIMEOUT
from refseq_bench.scenarios.cli.mission import (
    BELOW,
    LEARNT,
    Goal,
    Landmark,
    MissionText,
    Start,
    TripOptions,
    compiled_mission,
)
from refseq_bench.scenarios.cli.terminal.console import err, out
from refseq_bench.scenarios.cli.terminal.options import MapFile, Screen, flag, grouped, only_one_of, option
from refseq_bench.scenarios.cli.terminal.outputs import SCREENING, file_to_write
from refseq_bench.scenarios.cli.terminal.screen import in_file, on_screen
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_output, load_map
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq.access.policy import AccessPolicy
    from refseq.modules.process import Module

app = group("Run the modules of a robot as processes that find each other, on one or several hosts.")

TOKEN = option(
    "TEXT",
    "16 or more letters and digits, the same for all modules. [default: this user's own, on this machine]",
    envvar="REFSEQ_TOKEN",
    show_envvar=True,
)
PORT = option("PORT", "Port that the robot listens at.", min=1, max=65535)


@dataclass(frozen=True)
class Listening:
    """Where the robot listens."""

    panel: ClassVar[str] = "Access"
    host: Annotated[str, option("ADDRESS", "Address to listen at; other than this machine's, with --token only.")] = (
        "127.0.0.1"
    )
    port: Annotated[int, PORT] = 7447
    token: Annotated[str | None, TOKEN] = None


@dataclass(frozen=True)
class RobotAddress:
    """Where the robot is."""

    panel: ClassVar[str] = "Access"
    address: Annotated[str, option("ADDRESS", "Host of the module robot.")] = "127.0.0.1"
    port: Annotated[int, PORT] = 7447
    token: Annotated[str | None, TOKEN] = None

    @property
    def policy(self) -> "AccessPolicy":
        """The same for the library. Raises ``RefseqError``."""
        from refseq.modules.link import policy_for

        return policy_for(self.address, self.port, self.token or "")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq module robot offices.refseq --renderer none`
* `REFSEQ_TOKEN=3f9ab27c0d1e4856 refseq module robot offices.refseq --host 0.0.0.0`

Exit codes: 0 the mission is completed; 1 not; 2 bad input.""",
)
@grouped
def robot(
    map_file: MapFile,
    start: Start = None,
    goal: Goal = None,
    realtime: Annotated[
        bool, flag("--realtime", "Let time go by as it does; else the simulation waits for each answer.")
    ] = False,
    trip: TripOptions = TripOptions(),
    access: Listening = Listening(),
) -> None:
    """Play the robot in a world: all other modules connect to it. It stands while one of them is gone."""
    from refseq.modules.link import opened, policy_for

    if trip.filmstrip is not None:
        raise ScenarioError("--filmstrip: nobody stands by here; valid is refseq mission run")
    policy = policy_for(access.host, access.port, access.token or "")
    map_, _, plan = compiled_mission(map_file, LEARNT, start, goal, None)

    import secrets

    from refseq_bench.scenarios.missions.trip import MissionTrip, bench_on_way, poses_of
    from refseq_bench.sim.modules.robot import RobotModule, RobotSettings, latency_line

    asked = MissionTrip.from_map(map_, **asdict(trip))
    settings = RobotSettings(asked.drive.trigger, realtime, not asked.odometry)
    with bench_on_way(asked, poses_of(map_, plan), plan) as bench, opened(policy, serves=True, waits=_told) as link:
        module = RobotModule(bench, link, secrets.token_hex(8), settings, _told)
        say(out, f"{asked.drive.robot} in {asked.drive.world}: listens at {policy.host} port {policy.port}")
        over = module.run()
    say(out, f"the mission is {over}; {latency_line(module.latency)}")
    if touched := [touch.thing for touch in module.touches.touches]:
        say(err, f"the robot touched {', '.join(touched)}")
    if over != "completed":
        raise typer.Exit(BELOW)


@app.command(cls=BenchCommand, epilog="Example: `refseq module control --address robot.local`")
@grouped
def control(access: RobotAddress = RobotAddress()) -> None:
    """Run behaviours: the Control layer, between the executor's orders and the robot's motors."""
    policy = access.policy

    from refseq_bench.sim.modules.control import ControlModule

    _run(ControlModule(), policy)


@app.command(cls=BenchCommand, epilog="Example: `refseq module localiser offices.refseq --address robot.local`")
@grouped
def localiser(map_file: MapFile, access: RobotAddress = RobotAddress()) -> None:
    """Answer the robot's views with beliefs."""
    policy, map_ = access.policy, load_map(map_file)

    from refseq.map.blocks.reckoned_once import reckon_once
    from refseq.modules.localiser import LocaliserModule

    module = LocaliserModule(map_)
    reckon_once(map_)
    _run(module, policy)


@app.command(
    cls=BenchCommand,
    epilog="""Example: `refseq module mission offices.refseq "[LD_LDMC]" --address robot.local`

Exit codes: 0 completed; 1 not; 2 bad input.""",
)
@grouped
def mission(
    map_file: MapFile,
    mission_text: MissionText = LEARNT,
    start: Start = None,
    goal: Goal = None,
    landmark: Landmark = None,
    odometry: Annotated[bool, flag("--by-odometry", "Go by the odometer alone, without views.")] = False,
    timeout: Annotated[float, option("SECONDS", "Longest simulated time of the mission, pauses apart.")] = TIMEOUT,
    access: RobotAddress = RobotAddress(),
) -> None:
    """Run a mission: the executor, which orders behaviours by what is believed, and print its log."""
    if not timeout > 0:  # nor NaN
        raise ScenarioError(f"--timeout {timeout:g} is not valid; valid is a time above 0 s")
    policy = access.policy
    map_, _, plan = compiled_mission(map_file, mission_text, start, goal, landmark)

    from refseq.modules.executor import MissionModule

    module = MissionModule(plan, len(map_), localised=not odometry, timeout=timeout, told=_told)
    _run(module, policy)
    if not module.executor.status.completed:
        say(err, f"not completed: {module.executor.why}")
        raise typer.Exit(BELOW)


@app.command(cls=BenchCommand, epilog="Example: `refseq module viewer offices.refseq --serve 9090`")
@grouped
def viewer(
    map_file: MapFile,
    rrd: Annotated[
        Path | None, file_to_write(SCREENING, "File for the viewer to write instead", rich_help_panel=Screen.panel)
    ] = None,
    screen: Screen = Screen(),
    access: RobotAddress = RobotAddress(),
) -> None:
    """Show views, beliefs and the executor's log as they come; a robot drives without one as well."""
    only_one_of(rrd=rrd, connect=screen.connect, serve=screen.serve)
    check_output(rrd)
    screen.check(rrd)
    from refseq.modules.link import opened
    from refseq.modules.process import run_module
    from refseq.modules.viewer import ViewerModule

    policy, map_ = access.policy, load_map(map_file)
    name = f"{map_file.name} at {policy.host}"
    with (
        opened(policy, serves=False, waits=_told) as link,
        in_file(rrd, name) if rrd is not None else on_screen(name, screen, live=True) as stream,
    ):
        module = ViewerModule(map_, stream, name)
        run_module(link, module, _told)
    say(out, f"showed {plural(module.shown, 'view')}")


def _run(module: "Module", policy: "AccessPolicy") -> None:
    """Connect to the robot, and run a module until the drive is over."""
    from refseq.modules.link import opened
    from refseq.modules.process import run_module

    with opened(policy, serves=False, waits=_told) as link:
        run_module(link, module, _told)


def _told(line: str) -> None:
    say(out, line)
