"""Options and arguments of the command line, each declared once, and the groups of them that commands share."""

import inspect
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_type_hints

import typer

from refseq_bench.scenarios.drives.inputs import DriveSelection, assignments, words
from refseq_bench.scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from refseq.access.policy import AccessPolicy
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.sim.drives.trigger import Trigger


class SpreadName(StrEnum):
    """Values of ``--robot-spread``: those of ``robots.individual.SPREADS``, not imported for help."""

    CALIBRATED = "calibrated"
    AS_BUILT = "as-built"


class LaserReach(StrEnum):
    """Values of ``--laser-range``; the modes of ``sim.sensors.laser_model.RangeMode``, not imported for help."""

    NEAR = "8"
    FAR = "80"


class RendererName(StrEnum):
    """Values of ``--renderer``: those of ``sim.rendering.renderer.RendererKind``, not imported for help."""

    BAKED = "baked"
    FILAMENT = "filament"
    CLASSIC = "classic"
    NONE = "none"


DEFAULT_RENDERER_NAME = RendererName.BAKED
"""The same as in ``sim.rendering.renderer``."""


class TrajectoryName(StrEnum):
    """Values of ``--trajectory``: those of ``refseq.logs.trajectories`` that are standard files."""

    TUM = "tum"
    KITTI = "kitti"


class FormatName(StrEnum):
    """Values of ``--format``: those of ``refseq.logs.formats.DriveFormat``, not imported for help."""

    MCAP = "mcap"
    ROSBAG2 = "rosbag2"
    ROSBAG2_SQLITE3 = "rosbag2-sqlite3"


class CameraRenderer(StrEnum):
    """Values of ``--renderer`` where pictures are what is wanted."""

    BAKED = "baked"
    FILAMENT = "filament"
    CLASSIC = "classic"


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """Declare an option: the placeholder of its value, nothing for a flag, and its help."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


def flag(name: str, text: str, **more: Any) -> Any:
    """Declare an option that takes no value."""
    return option("", text, name, **more)


def defaulting(declared: Any, default: str) -> Any:
    """The same option where leaving it out means something that no constant says."""
    other = copy(declared)
    other.help = f"{declared.help} [default: {default}]"
    return other


def output(text: str, metavar: str = "FILE") -> Any:
    """Declare a command's main result, as ``--output`` or ``-o``."""
    return option(metavar, text, "--output", "-o")


WORLD_HELP = "World of the library, corridor:SEED, building:SEED, both with dials, or floor plan (.toml)."
WORLD = option("WORLD", WORLD_HELP)
LIGHT = option(
    "LIGHT",
    "Preset (morning, noon, 16:00, 18:00, overcast, late-evening) or any hour, 17:45; behind it, commas between, "
    "cloud=0..1, lamps=auto|on|off, date=2008-06-15.",
)
CHANGE = option(
    "CHANGE",
    "Differences from the plan: none, few, busy, or strengths from 0 to 1, commas between, of people, walkers, doors, "
    "bins, furniture, posters, cars: people=0.5,doors=0.3.",
)
ROBOT = option("ROBOT", "Robot that drives.")
SPREAD = option(
    "SPREAD",
    "calibrated: one robot, well measured, makes all drives; as-built: each seed its own, with its own errors of "
    "wheels and mounts.",
)
ROUTE = option("ROUTE", "Route of the world.")
START = option("METRES", "Begin so far along the route.")
SEED = option("N", "Seed of every random draw.", min=0)
PICTURES = "baked: light worked out once; filament: photometric, slower; classic: crude"
RENDERER = option("RENDERER", f"{PICTURES}; none: laser only.")
CAMERA_RENDERER = option("RENDERER", f"{PICTURES}.")
SENSORS = option("NAMES", "Only these sensors, commas between: of our robots camera-1, camera-2, laser. [default: all]")
DISTANCE = option("METRES", "Take a view every so far by the odometer; 0: not by distance.")
TIMEOUT = option("SECONDS", "Longest simulated time for each step.")
SECONDS = option("SECONDS", "Simulated time to drive.")
RATE = option("FACTOR", "Simulated over real time.")
REFERENCE = option("FILE", "First drive, which the map was learnt from, for its pictures.")
CACHE = option("FOLDER", "Folder of recordings and answers that are kept. [default: the user's]")
SCRIPT = option("FILE", "Lead the robot by a script, or by a recording of `refseq drive`.")
NOTES = option("TEXT", "Free notes, kept in the recording.")
CASE = option("NAME", "Only this case or scenario; may be repeated. [default: all]")
METHODS = option("NAMES", "Only these methods, commas between: PROFILE/STAGE, a baseline as topometric, baselines.")
RECORDING = output("Recording to write (.mcap), or folder for a ROS 2 bag.")
FORMAT = option(
    "FORMAT",
    "mcap: a file with Foxglove's messages; rosbag2: a folder with those of ROS 2; rosbag2-sqlite3: the same as .db3.",
    "--format",
)
LOG_KINDS = "MCAP, a ROS bag, a CARMEN log, a folder of pictures."

World = Annotated[str, typer.Argument(metavar="WORLD", help=WORLD_HELP)]
RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="Robot, as `refseq robot list` names it.")]
MapFile = Annotated[Path, typer.Argument(metavar="MAP", help="Map (.refseq).")]
QueryFile = Annotated[Path, typer.Argument(metavar="QUERY", help=f"Later drive: {LOG_KINDS}")]
Drives = Annotated[
    list[Path],
    typer.Argument(
        metavar="REFERENCE QUERY", help="Pairs of drives, those in the same lights pooled; or a data set's folder."
    ),
]
Seed = Annotated[int, SEED]
Profile = Annotated[
    str,
    option(
        "PROFILE",
        "thesis: the method of 2008, with its values; counting: it without EM; best: ours; "
        "neural: it, by keys of a neural network of yours; thesis+chain.window=20: with a setting of yours.",
    ),
]
Features = Annotated[
    str | None,
    option(
        "NAMES",
        "Only these of sift, neural, dense, walls, doors, corners, boundary, hu and sectors, commas between. "
        "[default: the profile's]",
    ),
]
Sensors = Annotated[str | None, SENSORS]
Stages = Annotated[
    list[str] | None, option("STAGE", "uniform, prior or chain; may be repeated. [default: all]", "--stage")
]
AtLeast = Annotated[
    float | None,
    option("PERCENT", "Exit 1 if the last stage is right within 1.5 m less often.", min=0, max=100),
]
WriteTrajectory = Annotated[
    TrajectoryName | None,
    option(
        "FORMAT",
        "Write the last stage's poses, the odometry and the truth beside the beliefs: tum, with times, or kitti.",
        "--trajectory",
    ),
]
GroundTruthRule = Annotated[
    str | None,
    option(
        "RULE",
        "Right pictures of each query: frame±2, or frame+30±2 for a query that begins 30 pictures later, or a file "
        "(.csv, .npy, .npz). Scores are then in pictures, not metres.",
        "--ground-truth",
    ),
]
Json = Annotated[bool, flag("--json", "Print JSON, for other programs.")]
Along = Annotated[
    list[float] | None,
    option("METRES", "Place along the route; may be repeated. [default: three, a quarter apart]"),
]


@dataclass(frozen=True)
class Setting:
    """The world that a drive meets: its light, its differences from the plan, the stretch that is driven."""

    panel: ClassVar[str] = "World"
    light: Annotated[str, LIGHT] = "16:00"
    change: Annotated[str, CHANGE] = "none"
    change_seed: Annotated[int | None, option("N", "Seed of the change. [default: the drive's]", min=0)] = None
    route: Annotated[str, ROUTE] = "forward"
    start: Annotated[float, START] = 0.0
    seed: Annotated[int, option("N", "Seed of every random draw of the drive.", min=0)] = 1
    world_seed: Annotated[int, option("N", "Seed of the world's textures.", min=0)] = 0


@dataclass(frozen=True)
class Carrier:
    """The robot that drives and the sensors that it carries."""

    panel: ClassVar[str] = "Robot"
    robot: Annotated[str | None, ROBOT] = "robuter"
    robot_spread: Annotated[SpreadName, SPREAD] = SpreadName.CALIBRATED
    sensors: Annotated[str | None, SENSORS] = None
    camera: Annotated[
        list[str] | None,
        option("NAME=MODEL", "Another model of a camera: fire-i, fire-i-wide, or a file (.toml); may be repeated."),
    ] = None
    laser_range: Annotated[LaserReach, option("METRES", "Range of the laser: 8, in steps of 1 mm, or 80, of 1 cm.")] = (
        LaserReach.FAR
    )
    renderer: Annotated[RendererName | None, RENDERER] = DEFAULT_RENDERER_NAME


@dataclass(frozen=True)
class CarrierInMap(Carrier):
    """As ``Carrier``, where a map tells what drove when it was learnt."""

    robot: Annotated[str | None, defaulting(ROBOT, "the map's")] = None
    renderer: Annotated[RendererName | None, defaulting(RENDERER, "as the sensors need")] = None


@dataclass(frozen=True)
class Sampling:
    """When a view is taken."""

    panel: ClassVar[str] = "Views"
    distance: Annotated[float | None, defaulting(DISTANCE, "0.85")] = None
    turn: Annotated[
        float | None, option("DEGREES", "Take a view whenever the robot has turned so far.", min=1, max=360)
    ] = None
    time: Annotated[float | None, option("SECONDS", "Take a view at least so often.")] = None

    @property
    def trigger(self) -> "Trigger":
        """The same in radians. Raises ``SimError``."""
        from math import inf, radians

        from refseq_bench.sim.drives.trigger import Trigger

        turn = None if self.turn is None else radians(self.turn)
        for name, value, or_off in (
            ("distance", self.distance, ", or 0 for none by distance"),
            ("time", self.time, ""),
        ):
            if value is not None and not (0 < value < inf or (or_off and value == 0)):
                raise ScenarioError(f"--{name} {value:g} is not valid; it should be above 0 and finite{or_off}")
        if self.distance is None:
            return Trigger(turn=turn, time=self.time)
        return Trigger(distance=self.distance or None, turn=turn, time=self.time)

    def trigger_unless(self, on_request: bool) -> "Trigger | None":
        """The same, or None where a view is taken only on request. Raises ``ScenarioError`` for both at once."""
        for name, value in (("distance", self.distance), ("turn", self.turn), ("time", self.time)):
            if on_request and value is not None:
                raise ScenarioError(f"--on-request and --{name} {value:g} exclude each other; valid is one of them")
        return None if on_request else self.trigger


@dataclass(frozen=True)
class LogReading:
    """Choices on reading drives from their logs."""

    panel: ClassVar[str] = "Views"
    topics: Annotated[
        str | None,
        option(
            "NAME=TOPIC",
            "Name the topics of cameras and the laser, commas between: front=/cam0/image_raw,laser=/scan.",
        ),
    ] = None
    tolerance: Annotated[
        float | None,
        option("SECONDS", "Sensors within so much make one view. [default: half a period, at most 0.25]", min=0.0),
    ] = None
    late: Annotated[
        str | None,
        option(
            "NAME=SECONDS",
            "Stamps of a sensor, or truth, are so late against the odometry's, commas between: laser=0.12.",
        ),
    ] = None
    odometry: Annotated[
        str | None,
        option("FILE", "Odometry beside the log (TUM, KITTI, EuRoC, CSV), or a topic of it. [default: the log's]"),
    ] = None
    truth: Annotated[
        str | None,
        option("FILE", "True poses beside the log, likewise, or latitude and longitude. [default: the log's]"),
    ] = None

    def chosen(self) -> DriveSelection:
        """The same for the library."""
        return DriveSelection(
            odometry=self.odometry,
            truth=self.truth,
            topics=self.topics,
            tolerance=self.tolerance,
            late=self.late,
        )


@dataclass(frozen=True)
class ThinnedReading(LogReading):
    """The same, and how many of the views stay."""

    thin: Annotated[float | None, option("METRES", "Keep one view every so far. [default: all]", min=0.0)] = None

    def chosen(self) -> DriveSelection:
        """The same for the library."""
        return replace(super().chosen(), thin=self.thin)


@dataclass(frozen=True)
class Selection(ThinnedReading):
    """The part of a recording that is used."""

    views: Annotated[str | None, option("FROM:TO", "Only these views of the recording, TO not among them: 0:160.")] = (
        None
    )

    def chosen(self) -> DriveSelection:
        """The same for the library."""
        return replace(super().chosen(), views=self.views)


@dataclass(frozen=True)
class NoisySelection(Selection):
    """As ``Selection``, of logs whose odometry may have been replaced."""

    odometry_noise: Annotated[
        bool,
        flag("--odometry-noise", "Add noise to the odometry, for logs where mapped poses replaced it."),
    ] = False

    def with_noise(self, seed: int) -> DriveSelection:
        """The same for the library, with the seed of the noise where noise is asked for."""
        return replace(self.chosen(), noise_seed=seed if self.odometry_noise else None)


@dataclass(frozen=True)
class Screen:
    """The viewer: elsewhere, in a browser, or else one that is started here."""

    panel: ClassVar[str] = "Viewer (one is started here unless told otherwise)"
    connect: Annotated[str | None, option("URL", "Viewer that runs elsewhere: rerun+http://HOST:9876/proxy.")] = None
    serve: Annotated[int | None, option("PORT", "Browsers of this machine, until Ctrl-C.", min=1, max=65535)] = None
    memory_limit: Annotated[
        str, option("LIMIT", "Memory of a viewer started or served, 4GB or 50%; then the oldest is dropped.")
    ] = "50%"

    def check(self, instead: Path | None) -> None:
        """Raise ``RefseqError`` where nothing could be shown; files ``instead`` need no viewer."""
        from refseq.viewer.checks import check_answers, check_display, check_free

        if instead is not None:
            return
        if self.connect is not None:
            check_answers(self.connect)
        elif self.serve is not None:
            check_free(self.serve)
        else:
            check_display()


@dataclass(frozen=True)
class Access:
    """Where it is served, and to whom."""

    panel: ClassVar[str] = "Access"
    port: Annotated[int, option("PORT", "Port to listen at; 0: any that is free.", min=0, max=65535)] = 8765
    host: Annotated[str, option("ADDRESS", "Address to listen at; other than this machine's, with --token only.")] = (
        "127.0.0.1"
    )
    token: Annotated[
        str | None,
        option(
            "TEXT",
            "16 or more letters and digits, asked for in the address. [default: random]",
            envvar="REFSEQ_TOKEN",
            show_envvar=True,
        ),
    ] = None
    origin: Annotated[
        list[str] | None,
        option("ORIGIN", "Web page that may connect, with the token: https://example.org; may be repeated."),
    ] = None

    @property
    def policy(self) -> "AccessPolicy":
        """The same for the library. Raises ``RefseqError`` for an address that is open to others."""
        from refseq.access.policy import AccessPolicy

        return AccessPolicy(self.host, self.port, self.token or "", tuple(self.origin or ()))


def drive_in(world: str, setting: Setting, carrier: Carrier, sampling: Sampling, **more: Any) -> "Drive":
    """Put a drive together. Raises the rooms' own errors for what cannot be read."""
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
    from refseq_bench.sim.sensors.laser_model import RangeMode

    sensors, cameras = words(carrier.sensors, "sensors"), assignments(carrier.camera, "camera")
    for name, model in cameras.items():
        if sensors is not None and name not in sensors:
            raise ScenarioError(
                f"--camera {name}={model}: has no effect, as {name} is not among --sensors {carrier.sensors}; valid is "
                "to ask for both"
            )
    asked: dict[str, Any] = {
        "world": world,
        **{one.name: getattr(setting, one.name) for one in fields(setting)},
        "robot": carrier.robot,
        "robot_spread": carrier.robot_spread.value,
        "sensors": sensors,
        "cameras": cameras,
        "laser": RangeMode[f"METRES_{carrier.laser_range.value}"],
        "renderer": RendererKind(carrier.renderer or DEFAULT_RENDERER),
        "trigger": sampling.trigger,
    }
    return Drive(**{**asked, **more})


def only_one_of(**given: object) -> None:
    """Raise ``ScenarioError`` where more than one of some options is given."""
    chosen = [
        f"--{name.replace('_', '-')}" for name, value in given.items() if value is not None and value is not False
    ]
    if len(chosen) > 1:
        raise ScenarioError(f"{' and '.join(chosen)} exclude each other; valid is one of them, or none")


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Make an option of each field of a parameter that is a dataclass; its default's fields are theirs."""
    groups: dict[str, type] = {}
    parameters = list(_expanded(inspect.signature(command), groups))

    def called(**given: Any) -> None:
        made = {name: kind(**{one.name: given.pop(one.name) for one in fields(kind)}) for name, kind in groups.items()}
        command(**given, **made)

    called.__name__, called.__doc__, called.__module__ = command.__name__, command.__doc__, command.__module__
    called.__annotations__ = {one.name: one.annotation for one in parameters}
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return called


def _expanded(signature: inspect.Signature, groups: dict[str, type]) -> Iterator[inspect.Parameter]:
    keyword = inspect.Parameter.KEYWORD_ONLY
    for parameter in signature.parameters.values():
        kind = parameter.annotation
        if not (isinstance(kind, type) and is_dataclass(kind)):
            yield parameter.replace(kind=keyword)
            continue
        groups[parameter.name] = kind
        for name, hint in get_type_hints(kind, include_extras=True).items():
            if name == "panel":
                continue
            declared = copy(hint.__metadata__[0])
            declared.rich_help_panel = kind.panel  # type: ignore[attr-defined]
            yield inspect.Parameter(
                name,
                keyword,
                default=getattr(parameter.default, name),
                annotation=Annotated[hint.__origin__, declared],
            )
