"""Files that list the right reference pictures of each query: CSV and NumPy; nothing is unpickled."""

import csv
import math
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from refseq.files import check_input, open_input
from refseq.limits import ARRAY_BYTES, FILES, RIGHT_PICTURES, ROW_BYTES
from refseq.logs.decoding.unpacking import translating
from refseq_bench.scenarios.errors import ScenarioError

VALID_TABLE = "valid are rows of query,reference or query,first,last: numbers of pictures from 0"
VALID_ARRAY = "valid are (queries,) numbers, −1 for none, or (queries, references) of 0 and 1"

PREFERRED = ("GTsoft", "GThard")
"""Arrays of VPR_Tutorial's data sets, the more lenient first."""

Right = tuple[int | None, Mapping[int, Sequence[int]]]
"""Number of queries where the file tells it, and the right reference pictures of each by its number."""


def read_right(path: Path) -> Right:
    """Read a ground truth by the ending of its name. Raises ``ScenarioError`` in one line for what is none."""
    readers = {".csv": _read_csv, ".txt": _read_csv, ".npy": _read_npy, ".npz": _read_npz}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise ScenarioError(f"{path}: is no ground truth; valid are frame±N and files that end in {', '.join(readers)}")
    try:
        return reader(path)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror or error}") from error


def _read_csv(path: Path) -> Right:
    right: dict[int, list[int]] = {}
    count = 0
    for number, row in _rows(path):
        query, first = row[0], row[1]
        last = row[2] if len(row) == 3 else first
        if not 0 <= first <= last:
            raise ScenarioError(f"{path}: line {number}: reference pictures {first} to {last}; {VALID_TABLE}")
        count += last - first + 1
        RIGHT_PICTURES.check(count, f"{path}: line {number}: declares", ScenarioError)
        right.setdefault(query, []).extend(range(first, last + 1))
    if not right:
        raise ScenarioError(f"{path}: holds no row; {VALID_TABLE}")
    return None, right


def _rows(path: Path) -> Iterator[tuple[int, list[int]]]:
    """Rows of numbers, by line; a header is passed over."""
    refused = translating(lambda reason: ScenarioError(f"{path}: {reason}; {VALID_TABLE}"), ScenarioError)
    with open_input(path) as file, refused:
        for number, row in enumerate(csv.reader(_text_lines(path, file)), start=1):
            fields = [field.strip() for field in row if field.strip()]
            if not fields or fields[0].startswith("#") or (number == 1 and not _is_number(fields[0])):
                continue
            if len(fields) not in (2, 3) or not all(map(_is_number, fields)):
                raise ScenarioError(f"{path}: line {number}: {','.join(row)!r:.60} is no row of it; {VALID_TABLE}")
            yield number, [int(float(field)) for field in fields]


def _text_lines(path: Path, file: IO[bytes]) -> Iterator[str]:
    while line := file.readline(ROW_BYTES + 1):
        ROW_BYTES.check(len(line), f"{path}: has", ScenarioError)
        yield line.decode("utf-8-sig", errors="replace")


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(value := float(text)) and value == int(value) and 0 <= value < FILES
    except (ValueError, OverflowError):
        return False


def _read_npy(path: Path) -> Right:
    with open_input(path) as file:
        return _from_array(path, path.name, _array(path, path.name, file, path.stat().st_size))


def _read_npz(path: Path) -> Right:
    """The array ``GTsoft``, else ``GThard``, with a row a reference picture (VPR_Tutorial); or the only one."""
    refused = translating(lambda reason: ScenarioError(f"{path}: is no .npz, or is damaged: {reason}"), ScenarioError)
    check_input(path)
    with refused, zipfile.ZipFile(path) as archive:
        names = {name.removesuffix(".npy"): name for name in archive.namelist()}
        wanted = [key for key in names if key in PREFERRED]
        keys = sorted(wanted, key=PREFERRED.index) or (list(names) if len(names) == 1 else [])
        if not keys:
            raise ScenarioError(
                f"{path}: holds the arrays {', '.join(names)[:80] or 'none'}; valid is GTsoft, GThard, or one alone"
            )
        key = keys[0]
        with archive.open(names[key]) as file:
            array = _array(path, key, file, archive.getinfo(names[key]).file_size)
    return _from_array(path, key, array.T if key in PREFERRED and array.ndim == 2 else array)


def _array(path: Path, name: str, file: IO[bytes], size: int) -> NDArray[Any]:
    """An array of numbers; its declared size is looked at before it is allocated."""
    with translating(lambda reason: ScenarioError(f"{path}: {name} is no NumPy array: {reason}"), ScenarioError):
        version = np.lib.format.read_magic(file)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_columns, dtype = read_header(file)
        if dtype.hasobject:
            raise ScenarioError(
                f"{path}: {name} holds pickled objects, which are programs and are not run; valid is an array of "
                "numbers: docs/data-sets.md tells how to convert it"
            )
        count = math.prod(shape)
        if dtype.kind not in "biuf" or count * dtype.itemsize > min(ARRAY_BYTES, size):
            raise ScenarioError(f"{path}: {name} is declared as {shape} of {dtype}; {VALID_ARRAY}")
        data = file.read(count * dtype.itemsize)
    if len(data) != count * dtype.itemsize:
        raise ScenarioError(f"{path}: {name} is cut off; {VALID_ARRAY}")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if by_columns else "C")


def _from_array(path: Path, name: str, array: NDArray[Any]) -> Right:
    if array.ndim not in (1, 2) or not array.size:
        raise ScenarioError(f"{path}: {name} is of shape {array.shape}; {VALID_ARRAY}")
    FILES.check(len(array), f"{path}: {name} is of so many queries:", ScenarioError)
    if array.ndim == 2:
        return len(array), _from_matrix(path, name, array)
    if (wrong := ~((array >= -1) & (array < FILES) & (array == np.floor(array)))).any():
        raise ScenarioError(f"{path}: {name} holds {array[wrong][0]}; {VALID_ARRAY}")
    whole = array.astype(np.int64)
    return len(array), {query: [frame] for query, frame in enumerate(whole.tolist()) if frame >= 0}


def _from_matrix(path: Path, name: str, array: NDArray[Any]) -> Mapping[int, Sequence[int]]:
    """Right pictures by the rows of a matrix; row by row, for it may fill a good part of the memory."""
    right: dict[int, Sequence[int]] = {}
    count = 0
    for query, row in enumerate(array):
        if not ((row == 0) | (row == 1)).all():
            raise ScenarioError(f"{path}: {name}, of shape {array.shape}, holds other numbers; {VALID_ARRAY}")
        if (found := np.flatnonzero(row)).size:
            right[query] = found.tolist()
            count += found.size
            RIGHT_PICTURES.check(count, f"{path}: {name} has", ScenarioError)
    return right
