"""Read trajectory files: the format is told by the header's words, or else by the shape of the rows."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.files import open_input
from refseq.limits import METRES, ROW_BYTES, ROWS
from refseq.logs.epoch import epoch_unit
from refseq.logs.trajectories.columns import (
    HEADERS,
    METRE,
    POSITION,
    QUATERNION,
    RADIANS,
    SECONDS,
    Q,
    TrajectoryColumns,
    lacking,
    named_columns,
    shaped_columns,
)
from refseq.logs.trajectories.fields import clock_time, decimal_comma, fields_of, is_number, is_separated, names_of
from refseq.logs.trajectories.geodesy import utm, zone_of
from refseq.logs.trajectories.headings import are_degrees, headings_along
from refseq.logs.trajectories.planar import CAMERA_TO_WORLD, in_plane, is_camera_frame, rotations_of
from refseq.logs.trajectories.table import PoseTable, TrajectoryFormat

LARGEST = 1e20
"""The largest number that is believed: times in nanoseconds are below 1e19."""

UNIT_ERROR = 0.01
"""By how much a quaternion's length or a rotation's determinant may differ from 1: printed digits, not damage."""


@dataclass(frozen=True)
class _TrajectoryRow:
    """A line of a file, and its number for messages."""

    path: Path
    number: int
    fields: Sequence[str]

    def error(self, what: str) -> LogError:
        return LogError(f"{self.path}: line {self.number}: {what}")

    def value(self, column: int) -> float:
        try:
            value = float(self.fields[column])
        except ValueError:
            value = math.nan
        if not abs(value) <= LARGEST:
            raise self.error(
                f"{self.fields[column]!r:.40} is no finite number; valid is one in field {column + 1}, to {LARGEST:g}"
            )
        return value

    def time(self, column: int) -> float:
        """A number, or the seconds since 1970 of a date and time that names its zone."""
        written = clock_time(self.fields[column])
        if written is None:
            return self.value(column)
        if written.tzinfo is None:
            raise self.error(
                f"{self.fields[column]!r:.40} names no time zone; valid is one behind it, Z or +01:00, or seconds"
            )
        return written.timestamp()


def read_trajectory(path: Path, times: Path | None = None) -> PoseTable:
    """Read a trajectory: TUM, KITTI, EuRoC, or a table of x, y and heading, or of positions by satellite.

    A file named ``.relations`` holds those of the SLAM benchmark, whose rows look like TUM's.
    ``times`` is a file of a time [s] for each pose, for those of a format without (KITTI). Raises ``LogError`` with
    file and line for what is none of these formats, may be two of them, or does not hold what its format says.
    """
    header, rows, commas = _rows(path)
    if path.suffix == ".relations":
        return _related(path, rows)
    columns = _columns(path, header, rows, commas)
    if columns.form is TrajectoryFormat.KITTI:
        found = _kitti(path, rows)
    elif Q.LATITUDE in columns.places:
        found = _by_satellite(path, rows, columns)
    else:
        found = _keyed(path, rows, columns, *_poses(rows, columns))
    METRES.check(float(np.abs(found.poses[:, :2]).max()), f"{path}: holds a pose at")
    return found if times is None else _with_times(found, times)


def _rows(path: Path) -> tuple[Sequence[str], list[_TrajectoryRow], bool]:
    """The header's names, empty without one that fits; the rows; whether more than spaces separate numbers."""
    header = ""
    rows: list[_TrajectoryRow] = []
    commas = False
    for number, text in _lines(path):
        comment = text.startswith(("#", "%", "//"))
        row = _TrajectoryRow(path, number, fields_of(text))
        if not comment and (written := decimal_comma(row.fields)):
            raise row.error(f"{written!r:.40} has a decimal comma; valid are decimal points")
        if not rows and (comment or not (is_number(row.fields[0]) or clock_time(row.fields[0]))):
            if not comment and named_columns(names_of(header, len(row.fields))):
                raise row.error(f"{row.fields[0]!r:.40} is no number; valid is one, or 2023-11-14T22:13:20Z for a time")
            header = re.sub(r"^(#|%|//)\s*", "", text)
        elif not comment:
            rows.append(row)
            commas = commas or is_separated(text)
    if not rows:
        raise LogError(
            f"{path}: holds no pose; valid is a trajectory: TUM, KITTI, EuRoC, or a table ({HEADERS}) with commas, "
            "semicolons, tabs or spaces between"
        )
    for row in rows:
        if len(row.fields) != len(rows[0].fields):
            raise row.error(f"has {len(row.fields)} fields; valid are {len(rows[0].fields)}, as in the first row")
    return names_of(header, len(rows[0].fields)), rows, commas


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    try:
        with open_input(path) as file:
            number = 0
            while line := file.readline(ROW_BYTES + 1):
                number += 1
                ROWS.check(number, f"{path}: has")
                if len(line) > ROW_BYTES or b"\0" in line:
                    raise LogError(f"{path}: line {number}: is no text of a trajectory; valid are lines of numbers")
                if text := line.decode("utf-8", errors="replace").strip("\ufeff \t\r\n"):
                    yield number, text
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error


def _columns(path: Path, header: Sequence[str], rows: Sequence[_TrajectoryRow], commas: bool) -> TrajectoryColumns:
    count = len(rows[0].fields)
    if (named := named_columns(header)) is not None:
        return named
    whole = all(re.fullmatch(r"\d+(\.0*)?", row.fields[0]) for row in rows)
    shaped = shaped_columns(count, rows[0].value(0), whole, commas)
    if isinstance(shaped, str) and header:
        raise LogError(f"{path}: {lacking(header)}; valid are TUM, KITTI, EuRoC, or a header as {HEADERS}")
    if isinstance(shaped, str):
        raise LogError(
            f"{path}: rows of {count} numbers are no trajectory without a header that names them: {shaped}; valid are "
            f"TUM, KITTI, EuRoC, or a header as {HEADERS}"
        )
    return shaped


def _poses(rows: Sequence[_TrajectoryRow], columns: TrajectoryColumns) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Planar poses (n, 3) of rows with positions and headings or quaternions, and what is to be told of them."""
    places = columns.places
    table = {quantity: _column(rows, place) for quantity, place in places.items() if quantity in _POSE}
    unknown = []
    for quantity, known in ((Q.X, METRE), (Q.Y, METRE), (Q.Z, METRE), (Q.HEADING, RADIANS)):
        if (unit := columns.units.get(quantity, "")) and quantity in table:
            table[quantity] = table[quantity] * known.get(unit, 1.0)
            unknown += [_unknown(quantity, unit, next(iter(known)))] if unit not in known else []
    points = np.column_stack([table[Q.X], table[Q.Y]])
    if all(quantity in table for quantity in QUATERNION):
        quaternions = np.column_stack([table[quantity] for quantity in QUATERNION])
        rotations = rotations_of(_unit(rows, quaternions))
        return in_plane(np.column_stack([points, table.get(Q.Z, 0 * table[Q.X])]), rotations), tuple(unknown)
    if Q.HEADING in table:
        if columns.units.get(Q.HEADING, "") not in RADIANS:
            _check_radians(rows[0].path, points, table[Q.HEADING])
        return np.column_stack([points, table[Q.HEADING]]), tuple(unknown)
    return _headed(rows[0].path, points), (*unknown, "headings are those of the way driven")


def _check_radians(path: Path, points: NDArray[np.float64], headings: NDArray[np.float64]) -> None:
    """Raise ``LogError`` for headings of no known unit that are degrees, by the way driven."""
    if are_degrees(points, headings):
        raise LogError(
            f"{path}: its headings, up to {np.abs(headings).max():g}, go along its way as degrees and not as radians; "
            "valid is a header that names their unit: time,x,y,heading [deg], or heading [rad]"
        )


def _unknown(quantity: Q, unit: str, taken: str) -> str:
    return f"the unit {unit!r:.20} of {quantity.value} is not known: it is taken for {taken}"


_POSE = frozenset({*POSITION, *QUATERNION, Q.HEADING})


def _column(rows: Sequence[_TrajectoryRow], place: int) -> NDArray[np.float64]:
    return np.array([row.value(place) for row in rows])


def _unit(rows: Sequence[_TrajectoryRow], quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(quaternions, axis=1)
    if (wrong := np.flatnonzero(np.abs(lengths - 1) > UNIT_ERROR)).size:
        row = rows[int(wrong[0])]
        raise row.error(f"its quaternion is {lengths[wrong[0]]:.3g} long; valid are rotations, of length 1")
    return np.asarray(quaternions / lengths[:, None])


def _headed(path: Path, points: NDArray[np.float64]) -> NDArray[np.float64]:
    headings = headings_along(points)
    if not np.isfinite(headings).all():
        raise LogError(f"{path}: goes nowhere and names no heading; valid is one with a column of headings")
    return np.column_stack([points, headings])


def _by_satellite(path: Path, rows: Sequence[_TrajectoryRow], columns: TrajectoryColumns) -> PoseTable:
    latitudes, longitudes = (_column(rows, columns.places[quantity]) for quantity in (Q.LATITUDE, Q.LONGITUDE))
    for row, latitude, longitude in zip(rows, latitudes, longitudes, strict=True):
        if not (abs(latitude) < 84 and abs(longitude) <= 180):
            raise row.error(f"latitude {latitude:g}°, longitude {longitude:g}°; valid are -84 to 84 and -180 to 180")
    zone = zone_of(float(longitudes[0]))
    notes = (f"positions by satellite are metres of UTM zone {zone}", "headings are those of the way driven")
    return _keyed(path, rows, columns, _headed(path, utm(latitudes, longitudes, zone)), notes)


def _kitti(path: Path, rows: Sequence[_TrajectoryRow]) -> PoseTable:
    matrices = np.array([[row.value(column) for column in range(12)] for row in rows]).reshape(-1, 3, 4)
    rotations, positions = matrices[:, :, :3], matrices[:, :, 3]
    if (wrong := np.flatnonzero(np.abs(np.linalg.det(rotations) - 1) > 3 * UNIT_ERROR)).size:
        raise rows[int(wrong[0])].error("its first three columns of three are no rotation; valid are rows of 3×4 poses")
    notes: tuple[str, ...] = ()
    if is_camera_frame(positions, rotations):
        rotations, positions = CAMERA_TO_WORLD @ rotations, positions @ CAMERA_TO_WORLD.T
        notes = ("axes are a camera's, y down",)
    keys = np.arange(len(rows), dtype=np.float64)
    return PoseTable(path, TrajectoryFormat.KITTI, keys, in_plane(positions, rotations), True, notes)


def _related(path: Path, rows: Sequence[_TrajectoryRow]) -> PoseTable:
    # With graphs and solvers, which no other log needs: they take longer to import than most logs to open.
    from refseq.logs.trajectories.relations import FIELDS, poses_from_relations

    if len(rows[0].fields) != FIELDS:
        raise rows[0].error(f"has {len(rows[0].fields)} fields; valid are two times, x, y, z, roll, pitch and yaw")
    return poses_from_relations(path, np.array([[row.value(column) for column in range(FIELDS)] for row in rows]))


def _keyed(
    path: Path,
    rows: Sequence[_TrajectoryRow],
    columns: TrajectoryColumns,
    poses: NDArray[np.float64],
    notes: tuple[str, ...],
) -> PoseTable:
    """Poses with the time or the number of each row."""
    numbered = Q.TIME not in columns.places
    place = columns.places[Q.NUMBER if numbered else Q.TIME]
    keys = _column(rows, place) if numbered else np.array([row.time(place) for row in rows])
    if numbered:
        for row, key in zip(rows, keys.tolist(), strict=True):
            if key < 0 or key != int(key):
                raise row.error(f"number {key:g} is not valid; it should be a whole number of 0 or more")
    else:
        keys, more = _in_seconds(keys, columns.units.get(Q.TIME, ""))
        notes += more
    return _rising(PoseTable(path, columns.form, keys, poses, numbered, notes), rows)


def _in_seconds(times: NDArray[np.float64], unit: str) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Times [s] by the unit that the header gives, or by their size, which is told."""
    if SECONDS.get(unit, 1.0) != 1.0:
        return times * SECONDS[unit], ()
    unknown = (_unknown(Q.TIME, unit, "s"),) if unit and unit not in SECONDS else ()
    found = epoch_unit(abs(times[0]))
    if found is None or found.seconds == 1.0:
        return times, unknown
    return times * found.seconds, (f"times are {found.name}",)


def _rising(found: PoseTable, rows: Sequence[_TrajectoryRow]) -> PoseTable:
    """The same without poses that come twice. Raises ``LogError`` where the keys fall."""
    steps = np.diff(found.keys)
    what = "number" if found.numbered else "time"
    if (back := np.flatnonzero(steps < 0)).size:
        at = int(back[0])
        raise rows[at + 1].error(
            f"{what} {_written(found.keys[at + 1])} is before that of the row above, {_written(found.keys[at])}; valid "
            f"are {what}s that rise"
        )
    kept = np.concatenate([[True], steps > 0])
    if kept.all():
        return found
    notes = (*found.notes, f"{int((~kept).sum())} rows of the same {what} as the one above are left out")
    return replace(found, keys=found.keys[kept], poses=found.poses[kept], notes=notes)


def _written(key: float) -> str:
    """A time or number with all digits that tell it from the next one, also of one since 1970."""
    return f"{key:.6f}".rstrip("0").rstrip(".")


def _with_times(found: PoseTable, path: Path) -> PoseTable:
    """A numbered table with the times of a file, a row each. Raises ``LogError``."""
    if not found.numbered:
        raise LogError(f"{path}: gives times to {found.source}, which has its own; valid is no file of times")
    rows = [_TrajectoryRow(path, number, text.split()) for number, text in _lines(path) if not text.startswith("#")]
    if len(rows) <= found.keys[-1]:
        raise LogError(f"{path}: holds {len(rows)} times for {int(found.keys[-1]) + 1} poses; valid is one for each")
    stamps, notes = _in_seconds(np.array([row.value(0) for row in rows]), "")
    if (back := np.flatnonzero(np.diff(stamps) <= 0)).size:
        raise rows[int(back[0]) + 1].error(
            f"time {_written(stamps[back[0] + 1])} does not rise; valid are times that rise"
        )
    if found.form is TrajectoryFormat.KITTI and len(stamps) != len(found):
        raise LogError(f"{path}: holds {len(stamps)} times for {len(found)} poses; valid is one for each")
    keys = stamps[found.keys.astype(np.intp)]
    return replace(found, keys=keys, numbered=False, notes=(*found.notes, *notes))
