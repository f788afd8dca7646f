"""Logs taken apart by record, damaged in a record, a field or a declared size, and put together again."""

import bz2
import gzip
import io
import random
import shutil
import sqlite3
import zlib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import (
    Channel,
    Chunk,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from ruamel.yaml import YAML

from tests.robustness.attack import Attempt, attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import ODD_NUMBERS, damaged_bytes, damaged_text, damaged_tree, near_value
from tests.robustness.fuzzing import judged, run, tried
from tests.robustness.log_files import BAGS, FOLDERS, MCAPS, log_files

MAGIC = b"\x89MCAP0\r\n"
WAYS: tuple[tuple[tuple[str, ...], tuple[int, ...]], ...] = (
    (("info",), (0, 2)),
    (("info", "--json"), (0, 2)),
    (("check",), (0, 1, 2)),
    (("convert", "-o", "out.mcap"), (0, 2)),
    (("convert", "-o", "out.clf"), (0, 2)),
    (("convert", "-o", "out.tum", "--thin", "0.1"), (0, 2)),
)
"""Commands that read a log, and the exit codes that they may have."""


@attack(family="logs", promise="A damaged MCAP recording is read or refused in one line", tries=10_000, short=4)
def damaged_mcap(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    content = (log_files() / rng.choice(MCAPS)).read_bytes()
    (folder / "input.mcap").write_bytes(_damaged_mcap(rng, content))
    return _tried(rng, "input.mcap", folder)


@attack(family="logs", promise="A damaged ROS 1 bag is read or refused in one line", tries=10_000, short=2)
def damaged_rosbag1(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    content = (log_files() / rng.choice(BAGS)).read_bytes()
    (folder / "input.bag").write_bytes(_damaged_bag(rng, content))
    return _tried(rng, "input.bag", folder)


@attack(family="logs", promise="A damaged rosbag2 folder is read or refused in one line", tries=10_000, short=2)
def damaged_rosbag2(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    bag = folder / "input"
    shutil.copytree(log_files() / rng.choice(FOLDERS), bag)
    if rng.random() < 0.3:
        _damage_metadata(rng, bag / "metadata.yaml")
    elif found := next(bag.glob("*.db3"), None):
        _damage_tables(rng, found)
    else:
        found = next(bag.glob("*.mcap"))
        found.write_bytes(_damaged_mcap(rng, found.read_bytes()))
    return _tried(rng, "input", folder)


@attack(family="logs", promise="A damaged CARMEN log is read or refused in one line", tries=10_000, short=2)
def damaged_carmen(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    lines = (log_files() / "carmen.clf").read_text().splitlines()
    lines += ["ODOM 1 2 0.5 0 0 0 7 h 7", "RAWLASER1 0 -1.5 3 1 80 0.01 0 4 1 2 3 4 0 7 h 7"]
    content = "\n".join(_damaged_lines(rng, lines)).encode(errors="replace") + b"\n"
    if rng.random() < 0.2:
        content = damaged_bytes(rng, content)
    pack = rng.choice((bytes, bytes, gzip.compress, bz2.compress))
    content = pack(content)
    (folder / "input.clf").write_bytes(damaged_bytes(rng, content) if rng.random() < 0.1 else content)
    return _tried(rng, "input.clf", folder)


@attack(family="logs", promise="A folder with damaged pictures is read or refused in one line", tries=10_000, short=2)
def damaged_pictures(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    ending = rng.choice(("png", "jpg"))
    (folder / "input").mkdir()
    for file in (log_files() / "pictures").glob(f"*.{ending}"):
        content = file.read_bytes()
        if rng.random() < 0.5:
            content = _damaged_png(rng, content) if ending == "png" else _damaged_jpeg(rng, content)
        (folder / "input" / file.name).write_bytes(content)
    return _tried(rng, "input", folder)


@attack(family="logs", promise="A damaged trajectory is read or refused in one line", tries=10_000, short=2)
def damaged_trajectory(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    shutil.copy(log_files() / "carmen.clf", folder / "drive.clf")
    name, row = rng.choice(TRAJECTORIES)
    begin = 1_700_000_000
    lines = [row.format(t=begin + k / 3, ns=(begin * 3 + k) * 333_333_333, n=k, x=k * 0.3) for k in range(6)]
    head = {"a.gps.csv": ["time,latitude,longitude"], "b.csv": ["index,x,y,heading"]}.get(name, [])
    (folder / name).write_text("\n".join(_damaged_lines(rng, [*head, *lines])) + "\n", errors="replace")
    given = rng.choice(("--truth", "--odometry"))
    return tried(["log", "convert", "drive.clf", "-o", "out.tum", given, name], folder)


TRAJECTORIES = (
    ("a.tum", "{t:.6f} {x} 0.1 0 0 0 0 1"),
    ("a.kitti", "1 0 0 {x} 0 1 0 0 0 0 1 0.5"),
    ("a.csv", "{ns},{x},0.1,0,1,0,0,0,0,0,0"),
    ("a.gps.csv", "{t:.6f},47.{n}1,8.{n}2"),
    ("b.csv", "{n},{x},0.5,0.1"),
    ("a.relations", "{t:.6f} 1700000002.5 {x} 0.1 0 0 0 0.2"),
)


@replays("log")
def try_log(case: Path, folder: Path) -> Attempt:
    """Try a case with every command that reads logs."""
    copy = shutil.copytree if case.is_dir() else shutil.copy
    copy(case, folder / case.name)
    found = [_command(case.name, way, folder, codes) for way, codes in WAYS]
    return max(found, key=lambda one: one.fell is not None)


def _tried(rng: random.Random, name: str, folder: Path) -> Attempt:
    way, codes = rng.choice(WAYS)
    return _command(name, way, folder, codes)


def _command(name: str, way: tuple[str, ...], folder: Path, codes: tuple[int, ...]) -> Attempt:
    return tried(["log", way[0], name, *way[1:]], folder, codes)


def _damaged_lines(rng: random.Random, lines: list[str]) -> list[str]:
    """Lines of which some have an odd field, or are dropped, repeated or exchanged."""
    made = list(lines)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at, other = rng.randrange(len(made)), rng.randrange(len(made))
        words = made[at].replace(",", " , ").split(" ")
        match rng.randrange(7):
            case 0 | 1 | 2:
                odd = (*ODD_NUMBERS, "nan", "inf", "-1e300", "1e39", "9" * 5000, "x", "", "1e12", "-0.0", "1_0", "²")
                words[rng.randrange(len(words))] = str(rng.choice(odd))
                made[at] = " ".join(words).replace(" , ", ",")
            case 3:
                made[at] = damaged_text(rng, made[at])
            case 4 if len(made) > 1:
                del made[at]
            case 5:
                made[at:at] = [made[at]] * rng.choice((1, 3, 200))
            case _:
                made[at], made[other] = made[other], made[at]
    return made


def _damaged_mcap(rng: random.Random, content: bytes) -> bytes:
    """A recording damaged in its bytes, or in its records, which are then packed and summed up afresh."""
    if rng.random() < 0.15:
        return damaged_bytes(rng, content)
    found = [one for one in StreamReader(io.BytesIO(content)).records if not isinstance(one, DataEnd | Footer)]
    records = [
        one for one in found[:200] if type(one).__name__ in ("Header", "Schema", "Channel", "Message", "Metadata")
    ]
    for _ in range(rng.choice((1, 1, 2, 4))):
        _damage_records(rng, records)
    return _packed(rng, records)


def _damage_records(rng: random.Random, records: list[McapRecord]) -> None:
    at, other = rng.randrange(len(records)), rng.randrange(len(records))
    match rng.randrange(10):
        case 0 if len(records) > 1:
            del records[at]
        case 1:
            records[at:at] = [records[at]] * rng.choice((1, 2, 50))
        case 2:
            records[at], records[other] = records[other], records[at]
        case 3 if isinstance(records[at], Message):
            records[at] = replace(records[at], data=damaged_words(rng, records[at].data))
        case _:
            records[at] = _damaged_record(rng, records[at])


def _damaged_record(rng: random.Random, record: McapRecord) -> McapRecord:
    field = rng.choice(fields(record))
    value = getattr(record, field.name)
    if isinstance(value, bytes):
        made: Any = damaged_bytes(rng, value)
    elif isinstance(value, dict):
        made = {str(key): str(one) for key, one in damaged_tree(rng, value).items()}
    else:
        made = near_value(rng, value)
        made = made if isinstance(made, type(value)) else value
    return replace(record, **{field.name: made})


def damaged_words(rng: random.Random, data: bytes) -> bytes:
    """Data of which an aligned word of four or eight bytes is an odd number."""
    size = rng.choice((4, 8))
    at = rng.randrange(max(1, len(data) // size)) * size
    word = (rng.choice(ODD_NUMBERS) % (1 << 8 * size)).to_bytes(size, "little")
    if rng.random() < 0.4:
        word = rng.choice((b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\xff\xff\x7f\xff", b"\0\0\0\0\0\0\xf8\x7f"))
    return data[:at] + word + data[at + len(word) :]


def _packed(rng: random.Random, records: list[McapRecord]) -> bytes:
    """The records as a file: with chunks or without, with a summary and right checksums or without."""
    builder = RecordBuilder()
    inside = rng.random() < 0.7
    chunk = RecordBuilder()
    written: list[McapRecord] = []
    metadata: list[MetadataIndex] = []
    for record in records:
        part = _bytes_of(record)
        if part is None:
            continue
        written.append(record)
        if isinstance(record, Metadata):
            metadata.append(MetadataIndex(8 + builder.count, len(part), "refseq"))
        (chunk if inside and isinstance(record, Schema | Channel | Message) else builder).write(part)
    if inside:
        _write_chunk(rng, builder, chunk.end())
    DataEnd(0).write(builder)
    body = MAGIC + builder.end()
    return body + (_summary(rng, body, written, metadata) if rng.random() < 0.7 else _footer(0, b"")) + MAGIC


def _bytes_of(record: McapRecord) -> bytes | None:
    """A record as the library writes it; None where the number is too large for its place."""
    builder = RecordBuilder()
    try:
        record.write(builder)
    except Exception:
        return None
    return builder.end()


def _write_chunk(rng: random.Random, builder: RecordBuilder, data: bytes) -> None:
    packers = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress, "brotli": bytes}
    compression = rng.choice(("", "zstd", "zstd", "lz4", "lz4", rng.choice(("zstd", "lz4", "brotli"))))
    packed, size, crc = packers[compression](data), len(data), zlib.crc32(data)
    if rng.random() < 0.15:
        packed = damaged_bytes(rng, packed)
    if rng.random() < 0.15:
        size = abs(rng.choice(ODD_NUMBERS))
    Chunk(compression, packed, 0, 0, crc if rng.random() < 0.9 else 1, size).write(builder)


def _summary(rng: random.Random, body: bytes, records: list[McapRecord], metadata: list[MetadataIndex]) -> bytes:
    builder = RecordBuilder()
    counts: dict[int, int] = {}
    for record in records:
        if isinstance(record, Message):
            counts[record.channel_id] = counts.get(record.channel_id, 0) + 1
    for record in records:
        if isinstance(record, Schema | Channel):
            builder.write(_bytes_of(record) or b"")
    told = Statistics(0, 1, len(counts), counts, 0, 0, sum(counts.values()), len(metadata), len(counts))
    for record in (told if rng.random() < 0.8 else _damaged_record(rng, told), *metadata):
        builder.write(_bytes_of(record) or b"")
    return _footer(len(body), builder.end())


def _footer(start: int, summary: bytes) -> bytes:
    head = RecordBuilder()
    Footer(start, 0, 0).write(head)
    footer = head.end()
    return summary + footer[:-4] + (zlib.crc32(summary + footer[:-4]) if summary else 0).to_bytes(4, "little")


def _damaged_bag(rng: random.Random, content: bytes) -> bytes:
    """A ROS 1 bag damaged in its bytes, or in a field or a length of one of its records."""
    if rng.random() < 0.3:
        return damaged_bytes(rng, content)
    made = bytearray(content)
    names = (b"op=", b"conn=", b"count=", b"index_pos=", b"chunk_pos=", b"time=", b"ver=", b"size=", b"compression=")
    for _ in range(rng.choice((1, 1, 2, 4))):
        name = rng.choice((*names, b"topic=", b"type=", b"md5sum=", b"chunk_count=", b"conn_count="))
        places = [k for k in range(len(made)) if made.startswith(name, k)]
        if not places:
            continue
        at = rng.choice(places)
        if rng.random() < 0.3:  # the declared length of the field, or of its header
            at -= 4
        else:
            at += len(name)
        made[at : at + 4] = (rng.choice(ODD_NUMBERS) % 2**32).to_bytes(4, "little")
    return bytes(made)


def _damage_metadata(rng: random.Random, file: Path) -> None:
    """A bag's metadata with a value changed, or as a text."""
    if rng.random() < 0.5:
        words = ("*a", "&a [*a]", "!!python/name:os.system", "../../../etc/passwd", "<<: *a", "? ", "- - - ", "\t")
        file.write_text(damaged_text(rng, file.read_text(), words), errors="replace")
        return
    yaml = YAML(typ="safe")
    tree = damaged_tree(rng, yaml.load(file.read_text()))
    text = io.StringIO()
    try:
        yaml.dump(tree, text)
    except RecursionError:  # it is too deep for the writer, which stops on the way
        text.write("[" * 5000)
    file.write_text(text.getvalue(), errors="replace")


def _damage_tables(rng: random.Random, file: Path) -> None:
    """A database with an odd value in a column, an odd table, or damaged bytes."""
    if rng.random() < 0.2:
        file.write_bytes(damaged_bytes(rng, file.read_bytes()))
        return
    columns = ("topics.name", "topics.type", "topics.serialization_format", "topics.id", "messages.topic_id")
    columns += ("topics.offered_qos_profiles", "messages.timestamp", "messages.data", "messages.data", "messages.data")
    with sqlite3.connect(file) as base:
        for _ in range(rng.choice((1, 2))):
            table, column = rng.choice(columns).split(".")
            try:
                rows = base.execute(f"SELECT rowid, {column} FROM {table}").fetchall()
                if rows and rng.random() < 0.7:
                    row, value = rng.choice(rows)
                    data = isinstance(value, bytes)
                    new = damaged_words(rng, value) if data and rng.random() < 0.6 else _odd_cell(rng, value)
                    base.execute(f"UPDATE {table} SET {column} = ? WHERE rowid = ?", (new, row))
                else:
                    base.execute(rng.choice(ODD_TABLES).format(table=table, column=column))
            except (sqlite3.Error, OverflowError, UnicodeEncodeError):
                continue
    base.close()


def _odd_cell(rng: random.Random, value: Any) -> Any:
    if isinstance(value, bytes) and rng.random() < 0.7:
        return damaged_bytes(rng, value)
    return rng.choice((None, "", "x" * 1000, 1.5, b"\0", b"\x28\xb5\x2f\xfd", 2**62, -1, near_value(rng, str(value))))


ODD_TABLES = (
    "DELETE FROM {table}",
    "DROP TABLE {table}",
    "ALTER TABLE {table} RENAME TO other",
    "ALTER TABLE {table} RENAME COLUMN {column} TO other",
    "ALTER TABLE {table} ADD COLUMN more DEFAULT 7",
    "INSERT INTO {table} SELECT * FROM {table} WHERE 0",
    "UPDATE {table} SET {column} = NULL",
    "UPDATE {table} SET {column} = 'text'",
    "UPDATE schema SET schema_version = 99",
    "DROP TABLE schema",
    "DROP TABLE message_definitions",
    "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x FROM c",
)


def _damaged_png(rng: random.Random, content: bytes) -> bytes:
    """A PNG with a chunk dropped, repeated, exchanged or damaged; checksums are right."""
    if rng.random() < 0.2:
        return damaged_bytes(rng, content)
    chunks, at = [], 8
    while at + 12 <= len(content):
        size = int.from_bytes(content[at : at + 4], "big")
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + size]))
        at += 12 + size
    k = rng.randrange(len(chunks))
    kind, data = chunks[k]
    match rng.randrange(6):
        case 0:
            del chunks[k]
        case 1:
            chunks[k:k] = [chunks[k]] * rng.choice((1, 30))
        case 2:
            chunks[k] = rng.choice((b"PLTE", b"tRNS", b"acTL", b"fcTL", b"IDAT", b"eXIf", b"zTXt")), data
        case _:
            head = kind == b"IHDR" and rng.random() < 0.7
            chunks[k] = kind, _odd_size(rng, data) if head else damaged_bytes(rng, data)
    parts = (
        len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big") for kind, data in chunks
    )
    return content[:8] + b"".join(parts)


def _odd_size(rng: random.Random, data: bytes) -> bytes:
    sizes = (0, 1, 2, 7, 8192, 30_000, 65_535, 2**26, 2**31 - 1, 2**32 - 1)
    width, height = (rng.choice(sizes).to_bytes(4, "big") for _ in range(2))
    return width + height + (data[8:] if rng.random() < 0.6 else rng.randbytes(5))


def _damaged_jpeg(rng: random.Random, content: bytes) -> bytes:
    """A JPEG with another size in its head, segments repeated, or damaged bytes."""
    at = content.find(b"\xff\xc0")
    match rng.randrange(4):
        case 0 if at > 0:
            sizes = (0, 1, 2, 8192, 30_000, 65_535)
            size = b"".join(rng.choice(sizes).to_bytes(2, "big") for _ in range(2))
            return content[: at + 5] + size + content[at + 9 :]
        case 1:
            scan = content.find(b"\xff\xda")
            return content[:-2] + content[scan:-2] * rng.choice((1, 5, 300)) + content[-2:]
        case 2:
            cut = rng.choice((b"\xff\xdb", b"\xff\xc4", b"\xff\xda", b"\xff\xc0"))
            return content.replace(cut, rng.choice((b"\xff\xc2", b"\xff\xe1", b"\xff\xd8", b"\xff\xff", b"")), 1)
    return damaged_bytes(rng, content)


@attack(family="logs", promise="A damaged ground truth is read or refused in one line", tries=10_000, short=2)
def damaged_ground_truth(seed: int, folder: Path) -> Attempt:
    rng = random.Random(seed)
    for name in ("reference", "query"):
        (folder / name).mkdir()
        for file in (log_files() / "pictures").glob("*.png"):
            shutil.copy(file, folder / name)
    name = rng.choice(("truth.csv", "truth.npy", "truth.npz"))
    (folder / name).write_bytes(_damaged_truth(rng, name))
    found = run(["compare", "reference", "query", "--ground-truth", name, "--methods", "seqslam"], folder)
    lines = [line for line in found.err.splitlines() if not line.startswith("pair ")]  # how far it is
    told = judged(replace(found, err="\n".join(lines)))
    return Attempt(told, {"s of CPU": found.cpu, "MiB": float(found.peak >> 20)})


def _damaged_truth(rng: random.Random, name: str) -> bytes:
    if name.endswith("csv"):
        rows = ["query,first,last", "0,0,1", "1,0,2", "2,1,2"]
        return "\n".join(_damaged_lines(rng, rows)).encode(errors="replace")
    whole = rng.choice(
        (np.eye(3, dtype=bool), np.eye(3), np.arange(3), np.arange(3, dtype=np.int16), np.zeros((3, 3, 3)))
    )
    flat = whole.reshape(-1)
    if rng.random() < 0.5 and flat.dtype.kind == "f":
        flat[rng.randrange(flat.size)] = rng.choice((np.nan, np.inf, 0.5, -1, 1e300))
    if rng.random() < 0.3:
        flat[rng.randrange(flat.size)] = rng.choice((-1, 1, 99))
    buffer = io.BytesIO()
    if name.endswith("npy"):
        np.save(buffer, whole)
    else:
        np.savez_compressed(buffer, **{rng.choice(("GTsoft", "GThard", "a")): whole})
    content = buffer.getvalue()
    if rng.random() < 0.5:
        shapes = (b"(3, 3)", b"(9, 9)", b"(0, 0)", b"(-1,)", b"(1e9)", b"[3,3]", b"(99999999999,)", b"()")
        content = content.replace(b"(3, 3)", rng.choice(shapes), 1)
    return damaged_bytes(rng, content) if rng.random() < 0.5 else content
