"""Schema of scenario files. Lengths are in metres, angles in degrees, times in seconds.

A file is a table of TOML. ``[reference]`` and ``[query]`` are drives to simulate, logs, or folders of images; what the
query does not say is as in the reference, but for its faults. Each ``[[further]]`` is one more reference, likewise.
With a table ``[mission]`` nobody drives the query: the robot is set down at its start and carries a mission out.
``[vary]`` makes several cases of one file (``refseq_bench.scenarios.campaign.declare.expand``); ``expect`` says what
decides (``refseq_bench.scenarios.campaign.declare.expectations``).
"""

from abc import abstractmethod
from dataclasses import fields
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from refseq.map.names import FEATURE_NAMES
from refseq_bench.scenarios.campaign.declare.assignment import ODOMETRY
from refseq_bench.scenarios.methods.names import written_out
from refseq_bench.sim.bench.faults import FAULTS, CameraBlack, Kidnap, LaserDazzled, WheelSlip
from refseq_bench.sim.drives.operator import UNEVEN, WIDEST
from refseq_bench.sim.drives.signal_faults import SignalFault
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
NotNegative = Annotated[Finite, Field(ge=0)]
Count = Annotated[int, Field(gt=0, strict=True)]
Seed = Annotated[int, Field(ge=0, strict=True)]
Flag = Annotated[bool, Field(strict=True)]


def _in_one_line(text: str) -> str:
    """A text that can be printed, and that the system can be asked for where it names a file."""
    if not text.isprintable():
        raise ValueError(f"{text!r:.60} is not valid; it should be one line of characters that can be printed")
    return text


def _known_feature(name: str) -> str:
    """The name of a feature."""
    if name not in FEATURE_NAMES:
        raise ValueError(f"{name!r:.60} is not valid; it should be one of {', '.join(FEATURE_NAMES)}")
    return name


def _rising(stretch: str) -> str:
    """A stretch that holds something, however many views there are."""
    first, last = stretch.split(":")
    if last and int(first or 0) >= int(last):
        raise ValueError(f"{stretch!r} holds nothing; valid is FROM:TO, FROM below TO")
    return stretch


def _told(title: str) -> str:
    if not title.strip():
        raise ValueError(f"{title!r} is not valid; it should be a line of words")
    return title


Line = Annotated[str, AfterValidator(_in_one_line)]
Feature = Annotated[str, AfterValidator(_known_feature)]
Stretch = Annotated[str, Field(pattern=r"^[0-9]*:[0-9]*$"), AfterValidator(_rising)]
FAULT_NUMBERS = tuple(
    sorted({one.name for fault in (*FAULTS, SignalFault) for one in fields(fault) if one.type is float})
)


def _with_numbers(fault: object) -> object:
    """A fault whose numbers are numbers, and no texts that look like some."""
    for key, value in fault.items() if isinstance(fault, dict) else ():
        if key in FAULT_NUMBERS and (not isinstance(value, int | float) or isinstance(value, bool)):
            raise ValueError(f"{key} = {value!r} is not valid; it should be a number")
    return fault


Fault = Annotated[
    Kidnap | CameraBlack | LaserDazzled | WheelSlip, Field(discriminator="kind"), BeforeValidator(_with_numbers)
]


class Table(BaseModel):
    """A table of the file: no key that is not known."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class TriggerTable(Table):
    """When a view is taken: after ``distance`` [m], ``turn`` [degrees] or ``time`` [s]; 0 switches one off."""

    distance: NotNegative = 0.85
    turn: NotNegative = 0.0
    time: NotNegative = 0.0


class DriveTable(Table):
    """A drive to simulate; the fields of ``refseq_bench.scenarios.drives.drive.Drive`` but its seed.

    ``robot_spread``: ``as-built`` gives each drive a robot of its own, ``calibrated`` all the same one.
    ``operator`` scales how unevenly the person drives: 0 is perfect, 1 a person of the
    ``operator_style``; ``side`` [m] is the lane, to the left of the route. With ``behaviours``, as
    ``refseq_bench.robots.behaviours.written`` reads them, nobody leads the robot: it runs them from the start of the
    route on.
    """

    world: Line
    robot: str = "robuter"
    light: str = "16:00"
    change: str = "none"
    change_seed: Seed | None = None
    route: str = "forward"
    waypoints: tuple[tuple[Finite, Finite], ...] = ()
    start: NotNegative = 0.0
    end: Positive | None = None
    world_seed: Seed = 0
    renderer: RendererKind = DEFAULT_RENDERER
    trigger: TriggerTable = TriggerTable()
    cameras: dict[str, Line] = {}
    laser_range: Literal[8, 80] = 80
    operator: Annotated[Finite, Field(ge=0, le=UNEVEN)] = 1.0
    operator_style: Literal["careful", "weaving"] = "careful"
    side: Annotated[Finite, Field(ge=-WIDEST, le=WIDEST)] = 0.0
    robot_spread: Literal["calibrated", "as-built"] = "calibrated"
    faults: tuple[Fault, ...] = ()
    behaviours: tuple[Line, ...] = ()


class LogTable(Table):
    """A log in the folder of real recordings: ``views`` FROM:TO of it, one every ``thin`` metres.

    With ``odometry_noise`` its odometry is given noise, another for each seed: for logs whose poses were corrected.
    ``truth`` and ``odometry`` are a trajectory's file each in the same folder, or a topic; without them they are the
    log's own. ``topics``, ``tolerance`` [s] and ``late`` [s] pair its sensors, as the options of ``learn`` do.
    """

    log: Line
    views: Stretch | None = None
    thin: NotNegative = 0.0
    odometry_noise: Flag = False
    truth: Line | None = None
    odometry: Line | None = None
    topics: dict[Line, Line] = {}
    tolerance: NotNegative | None = None
    late: dict[Line, Finite] = {}


class ImagesTable(Table):
    """A folder of images in the folder of real recordings, one every ``spacing`` metres, made ``width`` pixels wide."""

    images: Line
    spacing: Positive = 1.0
    width: Count = 640


def kind_of(table: object) -> str:
    """Kind of source of a table, by the key that only this kind has."""
    keys = table if isinstance(table, dict) else vars(table)
    return next((kind for kind in ("log", "images") if kind in keys), "drive")


ONLY_SEED = (1,)
"""Seeds by default where nothing is drawn from them."""


def is_drawn(table: "DriveTable | LogTable | ImagesTable") -> bool:
    """Tell whether another seed makes other views: of a simulated drive, or with noise on a log's odometry."""
    return isinstance(table, DriveTable) or (isinstance(table, LogTable) and table.odometry_noise)


SourceTable = Annotated[
    Annotated[DriveTable, Tag("drive")] | Annotated[LogTable, Tag("log")] | Annotated[ImagesTable, Tag("images")],
    Discriminator(kind_of),
]


class LearnTable(Table):
    """Making of our own localiser's maps; the fields of ``refseq_bench.scenarios.methods.shelf.Learning``."""

    features: Annotated[tuple[Feature, ...], Field(min_length=1)] | None = None
    words: Annotated[Finite, Field(gt=0, le=1)] = 1.0
    alike: Annotated[Finite, Field(ge=0, le=1)] | None = None


class AskedTable(Table):
    """Methods that are asked, and what they are given.

    ``judged`` is the method that expectations mean which name none, ``methods`` are those that run. Only ``sensors``
    are looked at. Where there are further references, our localiser has an atlas of all, with ``merge`` after what they
    share was taken out, else with each as it was learnt. ``learn`` says how its maps are made.
    """

    judged: str | None = None
    methods: tuple[str, ...] = ()
    sensors: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    merge: Flag = True
    learn: LearnTable = LearnTable()


class LocaliseTable(AskedTable):
    """Methods that are asked where the robot is.

    ``profile`` is the one whose stages ``success_uniform``, ``_prior`` and ``_hmm`` in expectations mean. ``judged`` is
    by default the profile's chain, ``methods``, names and groups of ``refseq_bench.scenarios.methods.names``, its
    stages. Only ``places`` FROM:TO of the reference are learnt. The query's views have ``signal_faults`` before any
    method is given them.
    """

    profile: str = "thesis"
    places: Stretch | None = None
    signal_faults: tuple[Annotated[SignalFault, BeforeValidator(_with_numbers)], ...] = ()


class GuideTable(AskedTable):
    """Methods that lead the robot: ``odometry``, ``lamp`` with a program, any of ``scenarios.methods.names``."""

    methods: Annotated[tuple[str, ...], Field(min_length=1)] = (ODOMETRY, "best/chain")


class MissionTable(Table):
    """Mission of the robot: one of ``string``, ``learnt`` and ``to``; beside it a program for ``lamp``.

    A ``string`` as in appendix C, or a mission's file (.toml); ``landmarks`` say where those of it are that are no
    doors: metres along the reference, ``start`` or ``end``. ``learnt``: the reference itself is the mission. ``to`` is
    a place by its path, ``PATH:end`` or ``PATH:12.5`` [m], to which a route is sought over all references. ``lamp`` is
    a program's file. ``goal`` is where the robot should be in the end, x and y [m]; by default the true place on the
    reference where the mission ends.
    """

    string: Line | None = None
    learnt: Flag = False
    to: Line | None = None
    lamp: Line | None = None
    landmarks: dict[Line, Finite | Literal["start", "end"]] = {}
    goal: tuple[Finite, Finite] | None = None


class ScoreTable(Table):
    """Tolerance of a right answer: ``within`` metres and ``heading`` degrees; ``narrow`` is a stricter one [m]."""

    within: Positive = 1.5
    narrow: Positive = 0.5
    heading: Positive = 30.0

    @model_validator(mode="after")
    def _narrower(self) -> Self:
        if self.narrow > self.within:
            raise ValueError(
                f"narrow = {self.narrow:g} is wider than within = {self.within:g}; valid is less, or as much"
            )
        return self


class LimitsTable(Table):
    """Limits of a drive in simulated control steps of 0.04 s, and of any task on the wall clock [s]."""

    steps: Count = 90_000
    seconds: Positive = 3600.0


class Declared(Table):
    """Keys that all scenarios have.

    There are ``further`` references where several paths are learnt. A scenario that is not ``blocking`` is run and
    shown, apart, and never makes a campaign fail. ``tags`` are names by which several are asked for. Each of ``seeds``
    is a drive of every reference and a query drive; where nothing ``is_drawn`` from them there is one. Parameters may
    be chosen on the ``training_seeds`` alone, which are never among them.
    """

    title: Annotated[Line, AfterValidator(_told)]
    source: str = ""
    note: str = ""
    tags: tuple[Line, ...] = ()
    blocking: Flag = True
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1, max_length=1000)] = (1, 2, 3, 4, 5)
    training_seeds: tuple[Seed, ...] = ()
    reference: SourceTable
    further: tuple[SourceTable, ...] = ()
    query: SourceTable
    localise: AskedTable
    score: ScoreTable = ScoreTable()
    limits: LimitsTable = LimitsTable()
    expect: tuple[str, ...] = ()

    @property
    def references(self) -> tuple[SourceTable, ...]:
        """All that is learnt."""
        return (self.reference, *self.further)

    @property
    def is_drawn(self) -> bool:
        """Another seed makes other views of a reference, or of the query."""
        return any(map(is_drawn, (*self.references, self.query)))

    @property
    def places(self) -> str | None:
        """The part FROM:TO of the reference that is learnt; None: all."""
        return None

    @property
    @abstractmethod
    def methods(self) -> tuple[str, ...]:
        """Names of the methods that run, groups written out, each once."""

    @property
    @abstractmethod
    def judged(self) -> str:
        """The method that is judged where an expectation names none."""


class Scenario(Declared):
    """Localising: the query is driven, and methods are asked where the robot was at each of its views."""

    localise: LocaliseTable = LocaliseTable()

    @property
    def places(self) -> str | None:
        """The part FROM:TO of the reference that is learnt; None: all."""
        return self.localise.places

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods that run, groups written out, each once."""
        asked = self.localise.methods or (self.localise.profile,)
        judged = () if self.localise.judged is None else (self.localise.judged,)
        return written_out((*asked, *judged), self.localise.sensors)

    @property
    def judged(self) -> str:
        """The method that is judged where an expectation names none: by default the only one, or our chain."""
        alone = self.methods[0] if len(self.methods) == 1 else None
        return self.localise.judged or alone or f"{self.localise.profile}/chain"


class MissionScenario(Declared):
    """Missions: the robot is set down where the query starts, and each method in turn leads it to the goal."""

    mission: MissionTable
    localise: GuideTable = GuideTable()

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods that lead the robot, groups written out, each once."""
        judged = () if self.localise.judged is None else (self.localise.judged,)
        return written_out((*self.localise.methods, *judged))

    @property
    def judged(self) -> str:
        """The method that is judged where an expectation names none: by default the last one."""
        return self.localise.judged or self.methods[-1]
