"""Schema of floor plans as people write them in TOML.

Lengths are in metres, angles in degrees (as on a drawing), light in lumen. Everything on a wall is placed by ``at``:
the distance of its centre from the wall's ``start``, along the wall.
"""

import datetime
from typing import Annotated, Literal
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.light import FIRST_DAY, LAST_DAY

FARTHEST = 1e4
"""Bound of coordinates, lengths and heights [m]: what is drawn and searched in cells grows with them.

Headings [deg] and speeds [m/s] have the same one.
"""


def _bounded(valid: str) -> AfterValidator:
    """Return a check against ``FARTHEST`` that tells the unit: what is beyond it was mostly meant in another one."""

    def checked(value: float) -> float:
        if abs(value) > FARTHEST:
            raise ValueError(valid)
        return value

    return AfterValidator(checked)


Coordinate = Annotated[float, Field(strict=True), _bounded(f"metres, from {-FARTHEST:g} to {FARTHEST:g}")]
Length = Annotated[float, Field(strict=True, gt=0.0), _bounded(f"metres, at most {FARTHEST:g}")]
Height = Annotated[float, Field(strict=True, ge=0.0), _bounded(f"metres, at most {FARTHEST:g}")]
Degrees = Annotated[float, Field(strict=True), _bounded(f"degrees, from {-FARTHEST:g} to {FARTHEST:g}")]
Speed = Annotated[float, Field(strict=True, gt=0.0), _bounded(f"metres a second, at most {FARTHEST:g}")]
Kelvin = Annotated[float, Field(strict=True, ge=1000.0, le=20_000.0)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
Lumen = Annotated[float, Field(strict=True, gt=0.0, le=1e6)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Point = tuple[Coordinate, Coordinate]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]


class _PlanTable(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Place(_PlanTable):
    """Where on Earth the world lies, and how it is turned."""

    latitude: Annotated[float, Field(strict=True, ge=-90.0, le=90.0)]
    longitude: Annotated[float, Field(strict=True, ge=-180.0, le=180.0)]
    timezone: str
    date: Annotated[datetime.date, Field(ge=FIRST_DAY, le=LAST_DAY)]
    x_azimuth: Annotated[float, Field(strict=True, ge=0.0, lt=360.0)]
    """Compass bearing of the world's x axis [deg], clockwise from north."""
    ground_albedo: Share = 0.2

    @field_validator("timezone")
    @classmethod
    def _is_known(cls, value: str) -> str:
        # The list of all of them takes a twentieth of a second to read, for each plan; it leaves these folders out.
        try:
            ZoneInfo(value)
            known = not value.startswith(("posix", "right/"))
        except (ZoneInfoNotFoundError, OSError, ValueError):
            known = False
        if not known:
            raise ValueError("a time zone of the IANA list, such as Europe/Lisbon")
        return value


class Material(_PlanTable):
    """A grey surface: ``albedo`` is the share of light that it reflects, ``roughness`` 0 is a mirror, 1 is matt."""

    albedo: Share
    roughness: Share
    remission: Annotated[float, Field(strict=True, ge=0.0, le=3.0)] | None = None
    """Light that a laser gets back, as a share of white plaster's; polished metal has more than 1. None: the albedo."""

    @property
    def echo(self) -> float:
        """Its remission [share of white plaster]."""
        return self.albedo if self.remission is None else self.remission


class Floor(_PlanTable):
    """The floor, or in the open air the ground; ``tile`` is the side of one tile [m]."""

    material: Name
    tile: Length = 0.4
    pattern: Literal["tiles", "carpet", "parquet", "asphalt"] = "tiles"
    area: tuple[Point, Point] | None = None
    """Two opposite corners of the ground in the open air; None: what lies between the walls."""


class Ceiling(_PlanTable):
    """The ceiling: square panels of ``panel`` metres at ``height`` above the floor."""

    height: Length
    material: Name
    panel: Length = 0.6


class Wall(_PlanTable):
    """A straight wall; ``start`` to ``end`` is the line of its inner face, seen from the side named by ``inside``."""

    name: Name
    start: Point
    end: Point
    inside: Literal["left", "right"]
    thickness: Length = 0.15
    height: Length | None = None
    """None: up to the ceiling; in the open air every wall has its own."""
    material: Name
    surface: Literal["plaster", "brick", "hedge"] = "plaster"

    @property
    def length(self) -> float:
        """Length of the inner face [m]."""
        return float(np.hypot(*np.subtract(self.end, self.start)))


class OnWall(_PlanTable):
    """A thing on a wall."""

    name: Name
    wall: Name
    at: Coordinate
    width: Length

    @property
    def extent(self) -> tuple[float, float]:
        """Where it begins and ends along the wall [m]."""
        return self.at - self.width / 2, self.at + self.width / 2


class Window(OnWall):
    """An opening with a glazed frame; ``sill`` is the height of its lower edge."""

    width: Length = 2.0
    height: Length = 1.5
    sill: Height = 0.9
    panes: Count = 2
    glazing: Literal["4mm", "6mm", "double"] = "double"

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return self.sill, self.sill + self.height


class Door(OnWall):
    """A door whose leaf lies ``recess`` behind the wall's face; ``open`` is the leaf's angle [deg], away from us."""

    width: Length = 0.9
    height: Length = 2.05
    recess: Length = 0.08
    open: Annotated[float, Field(strict=True, ge=0.0, le=110.0)] = 0.0
    hinge: Literal["start", "end"] = "start"
    depth: Length = 2.5
    """Depth of the room behind the door when it is open [m]."""
    label: str = ""
    material: Name = "door"

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return 0.0, self.height


class Sheet(OnWall):
    """Something flat on a wall, ``bottom`` above the floor."""

    height: Length
    bottom: Height

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return self.bottom, self.bottom + self.height


class Poster(Sheet):
    """A printed poster."""

    width: Length = 0.841
    height: Length = 1.189
    bottom: Height = 0.85
    style: Literal["text", "plots", "photo", "mixed", "diagram", "whiteboard"] = "mixed"


class Board(Sheet):
    """A notice board with pinned papers."""

    width: Length = 1.8
    height: Length = 1.0
    bottom: Height = 0.95
    sheets: Count = 8


class Cabinet(OnWall):
    """A cabinet that stands against a wall."""

    width: Length = 0.8
    height: Length = 1.8
    depth: Length = 0.35
    material: Name = "metal"

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return 0.0, self.height


class Bin(OnWall):
    """A round bin that stands against a wall; ``width`` is its diameter."""

    width: Length = 0.28
    height: Length = 0.6
    material: Name = "metal"

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return 0.0, self.height


class Fixture(OnWall):
    """A small thing on a wall: a fire extinguisher, a radiator, a switch, a sign; it stands out by ``depth``."""

    kind: Literal["extinguisher", "radiator", "switch", "sign"]
    height: Length
    bottom: Height
    depth: Length
    material: Name = "metal"

    @property
    def rise(self) -> tuple[float, float]:
        """Lower and upper edge above the floor [m]."""
        return self.bottom, self.bottom + self.height


class Standing(_PlanTable):
    """A thing that stands free on the floor; ``at`` is the middle of its footprint, ``heading`` turns it, 0 along x."""

    name: Name
    at: Point
    heading: Degrees = 0.0


class Furniture(Standing):
    """A piece of furniture; ``width`` runs along its heading, ``depth`` across it.

    A bench is a laboratory bench with drawers and things on it; a table has legs; a shelf stands open to both sides.
    """

    kind: Literal["bench", "table", "chair", "cupboard", "shelf", "pillar", "box"]
    width: Length
    depth: Length
    height: Length
    material: Name


SMALLEST: dict[str, tuple[float, float, float]] = {
    "bench": (0.9, 0.45, 0.5),
    "table": (0.4, 0.3, 0.3),
    "chair": (0.3, 0.3, 0.5),
    "cupboard": (0.5, 0.2, 0.6),
    "shelf": (0.4, 0.2, 0.4),
    "pillar": (0.05, 0.05, 0.2),
    "box": (0.05, 0.05, 0.05),
}
"""Width, depth and height [m] below which a kind of furniture cannot be built."""


class Stairs(Standing):
    """A flight of steps that rises along its heading from ``at``, the middle of its lowest edge."""

    width: Length
    steps: Count
    rise: Length = 0.17
    run: Length = 0.28
    material: Name


class Car(Standing):
    """A parked car; its paint reflects ``albedo`` of the light."""

    kind: Literal["hatchback", "saloon", "van"] = "hatchback"
    albedo: Share = 0.4


class Tree(Standing):
    """A tree; ``crown`` and ``trunk`` are radii."""

    height: Length = 6.0
    crown: Length = 1.8
    trunk: Length = 0.14


class Post(Standing):
    """A street lamp: ``height`` of its head above the ground."""

    height: Length = 5.0
    lumen: Lumen = 6000.0
    kelvin: Kelvin = 2700.0
    switch: Literal["dusk", "always"] = "dusk"


class Person(Standing):
    """Somebody who stands at ``at`` or walks from there along the points of ``walk`` and back, at ``speed`` [m/s].

    ``height`` in [m]; the clothes reflect ``albedo`` of the light.
    """

    height: Annotated[float, Field(strict=True, ge=1.2, le=1.9)] = 1.74
    albedo: Share = 0.25
    walk: tuple[Point, ...] = ()
    speed: Speed = 1.2

    @property
    def path(self) -> tuple[Point, ...]:
        """All points of the way; a single one for somebody who stands."""
        return self.at, *self.walk


class GroundLine(_PlanTable):
    """A thing that follows a line of points on the ground."""

    name: Name
    points: Annotated[tuple[Point, ...], Field(min_length=2)]
    material: Name


class Kerb(GroundLine):
    """A kerb stone along a line."""

    width: Length = 0.15
    height: Length = 0.12


class Marking(GroundLine):
    """Paint on the ground along a line."""

    width: Length = 0.12


class LampRow(_PlanTable):
    """``count`` equal lamps on the ceiling, the first at ``first``, each ``step`` on from the one before.

    ``switch``: ``dusk`` lamps burn when it gets dark outside, ``always`` ones unless all lamps are switched off.
    """

    name: Name
    first: Point
    step: Point
    count: Count
    size: tuple[Length, Length] = (1.2, 0.3)
    lumen: Lumen
    kelvin: Kelvin = 4000.0
    switch: Literal["dusk", "always"] = "dusk"

    @property
    def positions(self) -> Floats:
        """Centres of the lamps, (count, 2) [m]."""
        return np.asarray(self.first) + np.arange(self.count)[:, None] * np.asarray(self.step)


ON_WALL = ("window", "door", "poster", "board", "cabinet", "bin", "fixture")
"""Tables of the plan whose entries hang on a wall or stand against one."""
STANDING = ("furniture", "stairs", "car", "tree", "post", "person")
"""Tables of the plan whose entries stand free on the floor."""
LINES = ("kerb", "marking")
"""Tables of the plan whose entries follow a line on the floor."""
TABLES = ("wall", *ON_WALL, *STANDING, *LINES, "lamp")
"""All tables of the plan whose entries have names."""


class FloorPlan(_PlanTable):
    """A whole world as its author wrote it; one without a ceiling is in the open air."""

    name: Name
    title: str = ""
    """Name for people, in one line."""
    place: Place
    floor: Floor
    ceiling: Ceiling | None = None
    material: dict[Name, Material]
    wall: tuple[Wall, ...] = ()
    window: tuple[Window, ...] = ()
    door: tuple[Door, ...] = ()
    poster: tuple[Poster, ...] = ()
    board: tuple[Board, ...] = ()
    cabinet: tuple[Cabinet, ...] = ()
    bin: tuple[Bin, ...] = ()
    fixture: tuple[Fixture, ...] = ()
    furniture: tuple[Furniture, ...] = ()
    stairs: tuple[Stairs, ...] = ()
    car: tuple[Car, ...] = ()
    tree: tuple[Tree, ...] = ()
    kerb: tuple[Kerb, ...] = ()
    marking: tuple[Marking, ...] = ()
    post: tuple[Post, ...] = ()
    person: tuple[Person, ...] = ()
    lamp: tuple[LampRow, ...] = ()
    routes: dict[Name, Annotated[tuple[Point, ...], Field(min_length=2)]]

    @field_validator("title")
    @classmethod
    def _can_be_printed(cls, value: str) -> str:
        if not value.isprintable():
            raise ValueError("a line of characters that can be printed")
        return value

    def wall_named(self, name: str) -> Wall:
        """Return the wall of that name; the loader has made sure that there is one."""
        return next(w for w in self.wall if w.name == name)

    @property
    def roof(self) -> Ceiling:
        """The ceiling of a plan that is indoors; raises ``PlanError`` for one in the open air."""
        if self.ceiling is None:
            raise PlanError(f"world '{self.name}' is in the open air; it should have a ceiling")
        return self.ceiling

    def openings_in(self, wall: Wall) -> list[Window | Door]:
        """Return the windows and doors of a wall, in their order along it."""
        openings: tuple[Window | Door, ...] = (*self.window, *self.door)
        return sorted((item for item in openings if item.wall == wall.name), key=lambda item: item.at)

    @property
    def full_walls(self) -> tuple[Wall, ...]:
        """The walls that reach up to the ceiling."""
        return tuple(wall for wall in self.wall if wall.height is None)

    def wall_height(self, wall: Wall) -> float:
        """Return how high a wall is [m]."""
        return self.roof.height if wall.height is None else wall.height

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Smallest and largest corner of the ground's area, or of the walls' inner faces, (2,) each [m]."""
        corners = np.array(self.floor.area or [p for w in self.wall for p in (w.start, w.end)])
        return corners.min(axis=0), corners.max(axis=0)
