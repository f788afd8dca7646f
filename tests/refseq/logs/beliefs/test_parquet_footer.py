"""Sizes in a Parquet file's footer, against pyarrow's own reading of it."""

import io
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq.logs.beliefs.parquet_footer import declared_sizes

RNG = np.random.default_rng(5)
TABLE = pa.table(
    {
        "name": [f"view {i}" for i in range(300)],
        "sure": RNG.random(300) > 0.5,
        "places": [RNG.random(i % 7).tolist() for i in range(300)],
        "far": pa.array([None if i % 3 else i * 1e9 for i in range(300)]),
    }
)


def written(**options: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(TABLE.replace_schema_metadata({"notes": "x" * 200}), sink, **options)
    return sink.getvalue()


WHOLE = written(row_group_size=70)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"row_group_size": 70, "write_page_index": True, "write_page_checksum": True},
        {"row_group_size": 2, "compression": "zstd"},
        {"version": "1.0", "use_dictionary": False, "write_statistics": False},
        {
            "sorting_columns": [pq.SortingColumn(0)],
            "column_encoding": {"far": "BYTE_STREAM_SPLIT"},
            "use_dictionary": [],
        },
    ],
)
def test_sizes_are_those_that_pyarrow_reads(options: dict[str, object]) -> None:
    data = written(**options)
    metadata = pq.ParquetFile(io.BytesIO(data)).metadata
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    chunks = [group.column(number) for group in groups for number in range(group.num_columns)]
    file = io.BytesIO(data)
    expected = [(chunk.num_values, chunk.total_uncompressed_size) for chunk in chunks]
    assert declared_sizes(file, "a table") == expected
    assert file.tell() == 0


@given(st.data())
def test_a_damaged_footer_gives_sizes_or_one_line(data: st.DataObject) -> None:
    damaged = bytearray(WHOLE)
    length = int.from_bytes(WHOLE[-8:-4], "little")
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(len(WHOLE) - 8 - length, len(WHOLE) - 1))
        damaged[at] = data.draw(st.integers(0, 255))
    sizes: list[tuple[int, int]] = []
    with suppress(LogError):  # any other error fails the test
        sizes = declared_sizes(io.BytesIO(damaged), "a table")
    assert all(size >= 0 for pair in sizes for size in pair)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "a table: it has no footer of a Parquet file"),
        (b"PAR1", "a table: it has no footer of a Parquet file"),
        (b"PAR1" + b"\xff\xff\xff\x7fPAR1", "a table: it has no footer of a Parquet file"),
        (b"PAR1" + b"\x1c" * 40 + b"\x28\0\0\0PAR1", "a table: its footer is damaged"),
        (b"PAR1" + b"\0" + b"\x01\0\0\0PAR1", "a table: its footer is damaged"),
        (b"PAR1" + bytes(2 << 20) + (2 << 20).to_bytes(4, "little") + b"PAR1", "a table: its footer has 2097152 bytes"),
    ],
)
def test_what_has_no_footer(tmp_path: Path, content: bytes, told: str) -> None:
    path = tmp_path / "table.parquet"
    path.write_bytes(content)
    with path.open("rb") as file, pytest.raises(LogError) as caught:
        declared_sizes(file, "a table")
    assert str(caught.value).startswith(told)
