"""Columns of a trajectory file: what each is, by the header's words or by the shape of the rows."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from refseq.logs.epoch import NANOSECONDS
from refseq.logs.trajectories.table import TrajectoryFormat


class Quantity(StrEnum):
    """Quantity that a column of a trajectory file may hold."""

    TIME = "time"
    NUMBER = "index"
    X = "x"
    Y = "y"
    Z = "z"
    HEADING = "heading"
    QX = "qx"
    QY = "qy"
    QZ = "qz"
    QW = "qw"
    LATITUDE = "latitude"
    LONGITUDE = "longitude"


Q = Quantity
POSITION = (Q.X, Q.Y, Q.Z)
QUATERNION = (Q.QX, Q.QY, Q.QZ, Q.QW)
TUM_ORDER = (Q.TIME, *POSITION, *QUATERNION)
EUROC_ORDER = (Q.TIME, *POSITION, Q.QW, Q.QX, Q.QY, Q.QZ)

HEADERS = "time,x,y,heading or index,x,y,heading or time,x,y,z,qx,qy,qz,qw or time,latitude,longitude"
"""Headers that a message names as valid."""

WORDS: Mapping[str, Quantity] = MappingProxyType(
    {
        **dict.fromkeys(("time", "timestamp", "timestamps", "t", "stamp", "sec", "secs", "seconds"), Q.TIME),
        **dict.fromkeys(("index", "frame", "number", "scan", "view", "image", "id", "i", "k"), Q.NUMBER),
        **dict.fromkeys(("x", "px", "tx", "easting", "east"), Q.X),
        **dict.fromkeys(("y", "py", "ty", "northing", "north"), Q.Y),
        **dict.fromkeys(("z", "pz", "tz", "altitude", "alt", "height", "up"), Q.Z),
        **dict.fromkeys(("heading", "theta", "th", "yaw", "psi"), Q.HEADING),
        **dict.fromkeys(("latitude", "lat"), Q.LATITUDE),
        **dict.fromkeys(("longitude", "lon", "lng", "long"), Q.LONGITUDE),
        **{f"q{axis}": Quantity(f"q{axis}") for axis in "xyzw"},
    }
)


@dataclass(frozen=True)
class TrajectoryColumns:
    """Where each quantity stands in a row, and in which unit it is written, as the header says."""

    form: TrajectoryFormat
    places: Mapping[Quantity, int]
    units: Mapping[Quantity, str]


def named_columns(header: Sequence[str]) -> TrajectoryColumns | None:
    """Columns by a header's words; None where they do not make a trajectory."""
    places: dict[Quantity, int] = {}
    units: dict[Quantity, str] = {}
    for number, text in enumerate(header):
        quantity, unit = _meaning(text)
        if quantity is not None and quantity not in places:
            places[quantity] = number
            units[quantity] = unit
    if _missing(places):
        return None
    order = tuple(sorted(places, key=lambda quantity: places[quantity]))
    forms: dict[tuple[Quantity, ...], TrajectoryFormat] = {
        TUM_ORDER: TrajectoryFormat.TUM,
        EUROC_ORDER: TrajectoryFormat.EUROC,
    }
    form = forms.get(order, TrajectoryFormat.TABLE)
    return TrajectoryColumns(form, places, units)


def _meaning(text: str) -> tuple[Quantity | None, str]:
    """Quantity and unit of a column's name, as ``p_RS_R_x [m]``, ``time_ns``, ``pose.orientation.w`` have them."""
    match = re.fullmatch(r"\s*#?\s*([^\[(]*?)\s*(?:[\[(]\s*(.*?)\s*[\])])?\s*", text.lower())
    name, unit = (match[1], match[2] or "") if match else ("", "")
    parts = [part for part in re.split(r"[^a-z0-9]+", name) if part]
    if len(parts) > 1 and parts[-1] in ENDINGS:
        unit = unit or parts.pop()
    if not parts or parts[0] in ("v", "vel", "velocity", "b", "bias", "twist", "linear", "angular", "a", "w"):
        return None, unit
    if parts[0] in ("q", "quat", "quaternion", "orientation", "rotation") or "orientation" in parts:
        return WORDS.get(f"q{parts[-1]}", WORDS.get(parts[-1]) if parts[-1] == "yaw" else None), unit
    if "index" in parts:
        return Q.NUMBER, unit
    return WORDS.get("".join(parts)) or WORDS.get(parts[-1]), unit


ENDINGS = frozenset(("s", "ms", "us", "ns", "rad", "deg", "m", "mm", "cm"))
"""Units that a column's name may end with."""

SECONDS: Mapping[str, float] = MappingProxyType(
    {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
)
METRE: Mapping[str, float] = MappingProxyType(
    {"m": 1.0, "metres": 1.0, "meters": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3}
)
RADIANS: Mapping[str, float] = MappingProxyType(
    {
        **dict.fromkeys(("rad", "radians"), 1.0),
        **dict.fromkeys(("deg", "degrees", "°"), math.radians(1.0)),
        "mrad": 1e-3,
    }
)
"""Units of times, lengths and angles, by the words for them: how many seconds, metres and radians they are."""


def _missing(quantities: Collection[Quantity]) -> str:
    """Quantities that a trajectory has and these are not; empty where they suffice."""
    keyed = Q.TIME in quantities or Q.NUMBER in quantities
    placed = {Q.X, Q.Y} <= set(quantities) or {Q.LATITUDE, Q.LONGITUDE} <= set(quantities)
    return " and ".join((() if keyed else ("time or index",)) + (() if placed else ("x and y",)))


def lacking(header: Sequence[str]) -> str:
    """Reason why a header's words make no trajectory: what no column is, and the columns that are not known."""
    meanings = {text: _meaning(text)[0] for text in header}
    unknown = ", ".join(f"{text!r:.40}" for text, quantity in meanings.items() if quantity is None)
    told = f"; not known are {unknown}" if unknown else ""
    return f"its header names no {_missing([one for one in meanings.values() if one])}{told}"


def shaped_columns(count: int, first: float, whole: bool, commas: bool) -> TrajectoryColumns | str:
    """Columns of rows without a header, by their ``count``; else the reason why they cannot be told.

    ``first`` is the first number of the first row; ``whole`` says that the first of every row is a whole number,
    ``commas`` that there are some, or semicolons, between the numbers.
    """
    if count == 12:
        return TrajectoryColumns(TrajectoryFormat.KITTI, {}, {})
    if count >= 8 and commas and first >= NANOSECONDS.least:
        return _ordered(TrajectoryFormat.EUROC, EUROC_ORDER)
    if count == 8 and not commas:
        return _ordered(TrajectoryFormat.TUM, TUM_ORDER)
    if count == 8:
        return "the quaternion may begin with w or end with it"
    if count == 4 and not whole:
        return _ordered(TrajectoryFormat.TABLE, (Q.TIME, Q.X, Q.Y, Q.HEADING))
    if count == 4:
        return "the first may be a time or a number of a picture or scan"
    if count == 3:
        return "the first may be a time or x"
    return "no format has so many"


def _ordered(form: TrajectoryFormat, order: Sequence[Quantity]) -> TrajectoryColumns:
    return TrajectoryColumns(form, {quantity: number for number, quantity in enumerate(order)}, {})
