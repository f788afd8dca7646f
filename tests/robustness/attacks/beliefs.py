"""Tables of beliefs: parquet, damaged by column and value, in how it is packed, and in its bytes."""

import random
import shutil
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from tests.robustness.attack import attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import ODD_FLOATS, ODD_NUMBERS, ODD_TEXTS, damaged_bytes, odd_value
from tests.robustness.fuzzing import fell
from tests.robustness.samples import BELIEFS, DRIVE, samples

TYPES = (pa.int8(), pa.int64(), pa.uint32(), pa.float32(), pa.string(), pa.binary(), pa.bool_(), pa.list_(pa.string()))


@attack(family="files", promise="A damaged table of beliefs is refused in one line, or shown", tries=10_000, short=12)
def damaged_beliefs(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    content = (samples() / BELIEFS).read_bytes()
    if rng.random() < 0.4:
        (folder / "input.parquet").write_bytes(damaged_bytes(rng, content))
    else:
        _write_damaged(rng, pq.read_table(samples() / BELIEFS), folder / "input.parquet")
    return _tried(folder / "input.parquet", folder)


@replays("beliefs")
def try_beliefs(case: Path, folder: Path) -> str | None:
    shutil.copy(case, folder / "input.parquet")
    return _tried(folder / "input.parquet", folder)


def _tried(file: Path, folder: Path) -> str | None:
    for name in ("thesis.refseq", DRIVE):
        shutil.copy(samples() / name, folder)
    return fell(["view", "thesis.refseq", DRIVE, file.name, "-o", "beliefs.rrd"], folder)


def _write_damaged(rng: random.Random, table: pa.Table, path: Path) -> None:
    for _ in range(rng.choice((1, 1, 2, 3))):
        table = _damaged(rng, table)
    pq.write_table(
        table,
        path,
        compression=rng.choice(("snappy", "zstd", "gzip", "none", "lz4", "brotli")),
        use_dictionary=rng.random() < 0.5,
        row_group_size=rng.choice((1, 2, 1000)),
        write_page_checksum=rng.random() < 0.5,
    )
    if rng.random() < 0.1:
        path.write_bytes(damaged_bytes(rng, path.read_bytes()))


def _damaged(rng: random.Random, table: pa.Table) -> pa.Table:
    number = rng.randrange(table.num_columns)
    name, column = table.column_names[number], table.column(number)
    match rng.randrange(9):
        case 0:
            return table.remove_column(number) if table.num_columns > 1 else table
        case 1:
            return table.append_column(name, column)
        case 2:
            names = [*table.column_names]
            names[number] = rng.choice(ODD_TEXTS)[:100]
            return table.rename_columns(names)
        case 3:
            made = pa.array([None] * len(table), rng.choice((column.type, *TYPES)))
            return table.set_column(number, pa.field(name, made.type), made)
        case 4:
            try:
                return table.set_column(number, name, column.cast(rng.choice(TYPES), safe=False))
            except pa.ArrowException:
                return table
        case 5:
            rows = [rng.randrange(len(table)) for _ in range(rng.randrange(12))] if len(table) else []
            return table.take(pa.array(rows, pa.int64()))
    values = column.to_pylist()
    if values:
        values[rng.randrange(len(values))] = _odd(rng, values[rng.randrange(len(values))], column.type)
    try:
        return table.set_column(number, pa.field(name, column.type), pa.array(values, column.type))
    except (pa.ArrowException, OverflowError, ValueError, TypeError):
        return table


def _odd(rng: random.Random, value: Any, kind: pa.DataType) -> Any:
    """A value that a column of a kind can hold, and that is no belief's."""
    if rng.random() < 0.1:
        return None
    if pa.types.is_list(kind):
        values = list(value or [])
        for _ in range(rng.choice((1, 1, 2))):
            if values and rng.random() < 0.7:
                values[rng.randrange(len(values))] = _odd(rng, values[0], kind.value_type)
            else:
                values = rng.choice(([], values * 2, values[1:], values * 1000))
        return values
    if pa.types.is_floating(kind):
        return rng.choice(ODD_FLOATS)
    if pa.types.is_integer(kind):
        return rng.choice([number for number in ODD_NUMBERS if -(2**31) <= number < 2**31])
    return rng.choice(ODD_TEXTS) if pa.types.is_string(kind) else odd_value(rng)
