"""Beliefs as a parquet table: one row a view and method, written in one step."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from refseq.belief import LOST, Belief, PoseBeside, Stage, Timings, pose_beside
from refseq.errors import LogError, RefseqError
from refseq.fault import DeclaredFault, FaultKind
from refseq.files import naming_writes, open_input, replacing
from refseq.limits import BELIEF_BYTES, METRES
from refseq.logs.beliefs.parquet_footer import declared_sizes
from refseq.view import View

COSTS = tuple(f"{field.name}_s" for field in fields(Timings))
FAULT = pa.struct(
    [
        ("sensor", pa.string()),
        ("kind", pa.string()),
        ("since", pa.int32()),
        ("time_s", pa.float64()),
        ("evidence_nats", pa.float64()),
    ]
)
SCHEMA = pa.schema(
    [
        ("method", pa.string()),
        ("view", pa.int32()),
        ("time_s", pa.float64()),
        ("best", pa.int32()),
        ("lost", pa.float64()),
        ("entropy_nats", pa.float64()),
        ("path", pa.list_(pa.int32())),
        ("places", pa.list_(pa.float64())),
        ("true_x_m", pa.float64()),
        ("true_y_m", pa.float64()),
        ("true_heading_rad", pa.float64()),
        *((cost, pa.float64()) for cost in COSTS),
        ("faults", pa.list_(FAULT)),
        ("lost_after", pa.list_(pa.float64())),
        *((f"beside_{name}", pa.float64()) for name in ("along_m", "aside_m", "heading_rad")),
        ("beside_covariance", pa.list_(pa.float64())),
        ("odometer_scale", pa.float64()),
    ]
)
BESIDE = tuple(name for name in SCHEMA.names if name.startswith("beside_"))
OPTIONAL = ("faults", "lost_after", *BESIDE, "odometer_scale")
"""Columns that tables of earlier versions lack."""

FAR = float(METRES)
RANGES: Mapping[str, tuple[float, float]] = {
    "view": (0, 2**31 - 1),
    "time_s": (-1e12, 1e12),
    "best": (0, 2**31 - 1),
    "lost": (0.0, 1.0),
    "entropy_nats": (-1e-9, 50.0),
    "path": (LOST, 2**31 - 1),
    "places": (0.0, 1.0 + 1e-9),
    "lost_after": (0.0, 1.0 + 1e-9),
    "true_x_m": (-FAR, FAR),
    "true_y_m": (-FAR, FAR),
    "true_heading_rad": (-FAR, FAR),
    **dict.fromkeys(COSTS, (0.0, 1e9)),
    **dict.fromkeys(BESIDE, (-FAR, FAR)),
    "odometer_scale": (1e-6, 1e6),
}
"""Least and largest value of each column of numbers."""
MAY_LACK = ("true_x_m", "true_y_m", "true_heading_rad", "lost_after", *BESIDE)
ROUNDING = 1e-6
"""The probabilities of the places may sum to so much more or less than 1."""


def write_beliefs(
    path: Path | str,
    views: Sequence[View],
    beliefs: Mapping[str, Sequence[Belief]],
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write the beliefs of each method, a ``Stage`` or any other name; views without truth have null there.

    Raises ``LogError`` if it cannot.
    """
    rows = [
        _row(method, index, view, belief)
        for method, answers in beliefs.items()
        for index, (view, belief) in enumerate(zip(views, answers, strict=True))
    ]
    schema = SCHEMA.with_metadata({"refseq": json.dumps(dict(metadata or {}))})
    with naming_writes(path, LogError), replacing(Path(path)) as file:
        pq.write_table(pa.Table.from_pylist(rows, schema=schema), file, write_page_checksum=True)


def _row(method: str, index: int, view: View, belief: Belief) -> dict[str, object]:
    truth, pose = astuple(view.truth) if view.truth else (None, None, None), belief.pose
    return {
        "method": str(method),
        "view": index,
        "time_s": view.time,
        "best": belief.best,
        "lost": belief.lost,
        "entropy_nats": belief.entropy,
        "path": list(belief.path),
        "places": belief.places,
        **dict(zip(("true_x_m", "true_y_m", "true_heading_rad"), truth, strict=True)),
        **dict(zip(COSTS, astuple(belief.timings), strict=True)),
        "faults": [dict(zip(FAULT.names, astuple(fault), strict=True)) for fault in belief.faults],
        "lost_after": belief.lost_after,
        "odometer_scale": belief.odometer_scale,
        **({} if pose is None else dict(zip(BESIDE, (*pose.motion, pose.covariance.ravel()), strict=True))),
    }


@dataclass(frozen=True, slots=True)
class LocalisedViews:
    """A table of beliefs: by method one for each view, and the views' ``times`` [s]; the thesis' stages come first."""

    times: tuple[float, ...]
    beliefs: dict[str, list[Belief]]


def read_beliefs(path: Path | str) -> dict[str, list[Belief]]:
    """The beliefs of ``read_localised_views``."""
    return read_localised_views(path).beliefs


def read_localised_views(path: Path | str) -> LocalisedViews:
    """Read a table of beliefs.

    Raises ``LogError`` when the file is no table of beliefs, or holds what no belief is.
    """
    path = Path(path)
    try:
        with open_input(path) as file:
            # What a run of equal values takes on the disk says nothing of what it takes in memory.
            sizes = [max(size, 8 * values) for values, size in declared_sizes(file, f"{path}: is no table of beliefs")]
            BELIEF_BYTES.check(sum(sizes), f"{path}: takes")
            table = _read_table(pq.ParquetFile(file, page_checksum_verification=True), path)
        _check_columns(table, path)
        rows = table.sort_by("view").to_pylist()
    except (OSError, pa.ArrowException, MemoryError, OverflowError, UnicodeDecodeError) as error:
        told = getattr(error, "strerror", None) or (str(error).splitlines() or ["it takes too much memory"])[0]
        raise LogError(f"{path}: is no table of beliefs: {told:.200}") from error
    beliefs: dict[str, list[Belief]] = {stage: [] for stage in Stage}
    times: dict[int, float] = {}
    for row in rows:
        answers = beliefs.setdefault(row["method"], [])
        if row["view"] != len(answers):
            raise LogError(f"{path}: method {row['method']!r:.80} answers view {row['view']}; valid is {len(answers)}")
        where = f"{path}: method {row['method']!r:.80}, view {row['view']}"
        if times.setdefault(row["view"], row["time_s"]) != row["time_s"]:
            raise LogError(f"{where}: is of {row['time_s']} s; valid is another method's time, {times[row['view']]} s")
        answers.append(_belief(row, where))
    return LocalisedViews(tuple(times.values()), {method: answers for method, answers in beliefs.items() if answers})


def _read_table(file: pq.ParquetFile, path: Path) -> pa.Table:
    """All rows of a file. Raises ``LogError`` for other columns than those of ``SCHEMA``."""
    found = file.schema_arrow
    there = [wanted for wanted in SCHEMA if wanted.name not in OPTIONAL or wanted.name in found.names]
    for wanted in there:
        if len(found.get_all_field_indices(wanted.name)) != 1:
            raise LogError(f"{path}: is no table of beliefs: column {wanted.name!r} is missing, or there twice")
        if found.field(wanted.name).type != wanted.type:
            raise LogError(
                f"{path}: column {wanted.name!r} holds {found.field(wanted.name).type!s:.80}; valid is {wanted.type}"
            )
    return file.read(columns=[wanted.name for wanted in there])


def _check_columns(table: pa.Table, path: Path) -> None:
    """Raise ``LogError`` for a value that is missing, or outside of its column's range."""
    for name, column in zip(table.column_names, table.columns, strict=True):
        nulls = 0 if name in MAY_LACK else column.null_count
        if pa.types.is_list(column.type):
            column = pc.list_flatten(column)
            nulls += column.null_count
        if nulls:
            raise LogError(f"{path}: column {name!r} lacks a value; valid is one in every row")
        low, high = RANGES.get(name, (None, None))
        if low is None or not len(column):
            continue
        values = column.drop_null().to_numpy()
        outside = values[~((values >= low) & (values <= high))]
        if len(outside):
            raise LogError(f"{path}: column {name!r} holds {outside[0]}; valid are {low:g} to {high:g}")


def _belief(row: Mapping[str, Any], where: str) -> Belief:
    """A row as a belief. Raises ``LogError`` for one whose parts do not fit each other."""
    places, path = np.array(row["places"], np.float64), tuple(row["path"])
    if not abs(places.sum() - 1) < ROUNDING:
        raise LogError(f"{where}: the probabilities of {len(places)} places sum to {places.sum():g}; valid is 1")
    for name, number in (("best", row["best"]), ("path", max(path, default=0))):
        if number >= len(places):
            raise LogError(f"{where}: {name} is place {number}; valid are 0 to {len(places) - 1}")
    timings = Timings(*(row[cost] for cost in COSTS))
    faults = tuple(_fault(told, row["view"], where) for told in row.get("faults", ()))
    lost_after = _lost_after(row, len(places), where)
    pose, scale = _pose(row, where), row.get("odometer_scale", 1.0)
    return Belief(places, row["lost"], row["best"], path, row["entropy_nats"], timings, faults, lost_after, pose, scale)


def _lost_after(row: Mapping[str, Any], places: int, where: str) -> NDArray[np.float64] | None:
    """The Lost_Places of a row. Raises ``LogError`` where they are not one a place, or hold more than ``lost``."""
    if row.get("lost_after") is None:
        return None
    found = np.array(row["lost_after"], np.float64)
    if len(found) != places:
        raise LogError(f"{where}: lost_after has {len(found)} numbers; valid is {places}, one a place")
    if found.sum() > row["lost"] + ROUNDING:
        raise LogError(f"{where}: lost_after sums to {found.sum():g}; valid is at most lost, {row['lost']:g}")
    return found


def _pose(row: Mapping[str, Any], where: str) -> PoseBeside | None:
    """The pose beside the best place. Raises ``LogError`` for a part of one, and for what is no covariance."""
    told: list[Any] = [row.get(name) for name in BESIDE]
    if all(one is None for one in told):
        return None
    if any(one is None for one in told):
        raise LogError(f"{where}: has a part of {', '.join(BESIDE)}; valid are all or none")
    try:
        return pose_beside(told[:3], told[3])
    except RefseqError as error:
        raise LogError(f"{where}: {error}") from error


def _fault(told: Mapping[str, Any], view: int, where: str) -> DeclaredFault:
    """A fault that stood at a view. Raises ``LogError`` for one that no monitor declares."""
    sensor, kind, since, time, evidence = (told[name] for name in FAULT.names)
    if kind not in list(FaultKind):
        raise LogError(f"{where}: kind of fault {kind!r:.80} is not valid; valid are {', '.join(FaultKind)}")
    if since is None or not 0 <= since <= view:
        raise LogError(f"{where}: a fault since view {since}; valid are 0 to {view}")
    if not sensor or not all(number is not None and isfinite(number) for number in (time, evidence)):
        raise LogError(f"{where}: a fault lacks its sensor, time or evidence, or they are no numbers")
    return DeclaredFault(sensor, FaultKind(kind), since, time, evidence)
