"""Beliefs as a parquet table: one row a view and method, written in one step."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from refseq.belief import Belief, Stage, Timings
from refseq.errors import LogError
from refseq.files import replacing
from refseq.view import View

COSTS = tuple(f"{field.name}_s" for field in fields(Timings))
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
    ]
)


def write_beliefs(
    path: Path,
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
    try:
        with replacing(path) as file:
            pq.write_table(pa.Table.from_pylist(rows, schema=schema), file, write_page_checksum=True)
    except OSError as error:
        raise LogError(f"{path}: cannot be written: {error.strerror or error}") from error


def _row(method: str, index: int, view: View, belief: Belief) -> dict[str, object]:
    truth = astuple(view.truth) if view.truth else (None, None, None)
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
    }


def read_beliefs(path: Path) -> dict[str, list[Belief]]:
    """Read beliefs by method, in the order of views; the thesis' stages come first, in their order.

    Raises ``LogError`` when the file is no table of beliefs.
    """
    try:
        table = pq.read_table(path, page_checksum_verification=True)
    except (OSError, pa.ArrowInvalid) as error:
        raise LogError(f"{path}: is no table of beliefs: {str(error).splitlines()[0]}") from error
    for wanted in SCHEMA:
        if wanted.name not in table.column_names:
            raise LogError(f"{path}: is no table of beliefs: column {wanted.name!r} is missing")
        if table.schema.field(wanted.name).type != wanted.type:
            found = table.schema.field(wanted.name).type
            raise LogError(f"{path}: column {wanted.name!r} holds {found}; valid is {wanted.type}")
    beliefs: dict[str, list[Belief]] = {stage: [] for stage in Stage}
    for row in table.sort_by("view").to_pylist():
        belief = Belief(
            np.array(row["places"]),
            row["lost"],
            row["best"],
            tuple(row["path"]),
            row["entropy_nats"],
            Timings(*(row[cost] for cost in COSTS)),
        )
        beliefs.setdefault(row["method"], []).append(belief)
    return {method: answers for method, answers in beliefs.items() if answers}
