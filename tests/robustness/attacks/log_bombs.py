"""Small logs that declare or unpack to more than a robot's would: one try is one of ``BOMBS``."""

import bz2
import gzip
import json
import os
import sqlite3
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Message, Schema
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.typesys import Stores, get_typestore

from tests.robustness.attack import Attempt, attack
from tests.robustness.fuzzing import tried

MAGIC = b"\x89MCAP0\r\n"
HUGE = 1_300_000_000
FLASER = "FLASER {n} {ranges} 0 0 0 0 0 0 1.0 h 1.0\n"


def _mcap(folder: Path, schema: str, encoding: str, *chunks: Chunk) -> str:
    builder = RecordBuilder()
    Header("", "").write(builder)
    Schema(1, b"", "protobuf", schema).write(builder)
    Channel(1, "/a", encoding, {}, 1).write(builder)
    for chunk in chunks:
        chunk.write(builder)
    DataEnd(0).write(builder)
    Footer(0, 0, 0).write(builder)
    (folder / "a.mcap").write_bytes(MAGIC + builder.end() + MAGIC)
    return "a.mcap"


def _messages(count: int, data: bytes) -> bytes:
    builder = RecordBuilder()
    Message(1, 1, data, 1, 1).write(builder)
    return builder.end() * count


def _chunk(data: bytes, compression: str = "zstd") -> Chunk:
    pack = {"zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression]
    return Chunk(compression, pack(data), 0, 0, zlib.crc32(data), len(data))


def _zeros(count: int) -> bytes:
    """Zstandard of so many zeros, made piece by piece."""
    packer = zstandard.ZstdCompressor().compressobj(size=count)
    return b"".join([*(packer.compress(bytes(1 << 20)) for _ in range(count >> 20)), packer.flush()])


def mcap_that_unpacks_to_a_gigabyte(folder: Path) -> str:
    size = HUGE >> 20 << 20
    return _mcap(folder, "foxglove.LaserScan", "protobuf", Chunk("zstd", _zeros(size), 0, 0, 0, size))


def mcap_that_hides_a_gigabyte(folder: Path) -> str:
    return _mcap(folder, "foxglove.LaserScan", "protobuf", Chunk("zstd", _zeros(HUGE >> 20 << 20), 0, 0, 0, 1000))


def mcap_of_empty_messages(folder: Path) -> str:
    data = _messages(1_000_000, b"")
    return _mcap(folder, "foxglove.LaserScan", "protobuf", *[_chunk(data)] * 50)


def mcap_of_lz4(folder: Path) -> str:
    data = _messages(200_000, b"")
    return _mcap(folder, "foxglove.LaserScan", "protobuf", *[_chunk(data, "lz4")] * 10)


def mcap_of_transforms_without_end(folder: Path) -> str:
    return _mcap(folder, "foxglove.FrameTransforms", "protobuf", _chunk(_messages(1, b"\x0a\x00" * 30_000_000)))


def mcap_of_deep_json(folder: Path) -> str:
    return _mcap(folder, "foxglove.LaserScan", "json", _chunk(_messages(1, b"[" * 1_000_000)))


def mcap_of_a_number_of_json(folder: Path) -> str:
    told = {"timestamp": {"sec": 10**30, "nsec": -1}, "ranges": [1e400, 10**400]}
    return _mcap(folder, "foxglove.LaserScan", "json", _chunk(_messages(1, json.dumps(told).encode())))


def mcap_of_a_fine_scan(folder: Path) -> str:
    """100 000 ranges, which is as many as may be; learning must not hold a table of all against all."""
    ranges = np.full(100_000, 1.0).tobytes()
    body = b"\x1a\x05laser" + b"\x29" + struct.pack("<d", 6.28) + b"\x32" + _varint(len(ranges)) + ranges
    return _mcap(folder, "foxglove.LaserScan", "protobuf", _chunk(_messages(3, body)))


def _varint(number: int) -> bytes:
    made = bytearray()
    while number > 127:
        made.append(number & 127 | 128)
        number >>= 7
    return bytes([*made, number])


def carmen_of_a_long_count(folder: Path) -> str:
    (folder / "a.clf").write_text(f"FLASER {'9' * 5000} 1 2 3\n")
    return "a.clf"


def carmen_of_gzip(folder: Path) -> str:
    (folder / "a.clf").write_bytes(gzip.compress(b"ODOM 0 0 0 0 0 0 0 h 0\n" * 5_000_000))
    return "a.clf"


def carmen_of_bzip2(folder: Path) -> str:
    (folder / "a.clf").write_bytes(bz2.compress(b"a\n" * 5_000_000))
    return "a.clf"


def carmen_of_fine_scans(folder: Path) -> str:
    lines = FLASER.format(n=700, ranges="0.1 " * 699 + "0.1") * 20
    (folder / "a.clf").write_text(lines)
    return "a.clf"


def pictures_of_a_gigapixel(folder: Path) -> str:
    (folder / "a").mkdir()
    head = struct.pack(">IIBBBBB", 30_000, 30_000, 8, 0, 0, 0, 0)
    rows = zlib.compress(bytes(30_001 * 3000))
    parts = ((b"IHDR", head), (b"IDAT", rows), (b"IEND", b""))
    data = (len(d).to_bytes(4, "big") + k + d + zlib.crc32(k + d).to_bytes(4, "big") for k, d in parts)
    (folder / "a" / "1.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(data))
    return "a"


def pictures_that_are_empty(folder: Path) -> str:
    (folder / "a").mkdir()
    (folder / "a" / "1.png").touch()
    (folder / "a" / "2.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    return "a"


def pictures_that_are_pipes(folder: Path) -> str:
    (folder / "a").mkdir()
    os.mkfifo(folder / "a" / "1.png")
    (folder / "a" / "2.png").symlink_to("/dev/zero")
    return "a"


def a_pipe(folder: Path) -> str:
    os.mkfifo(folder / "a.mcap")
    return "a.mcap"


def a_device(folder: Path) -> str:
    (folder / "a.mcap").symlink_to("/dev/zero")
    return "a.mcap"


def bag_whose_metadata_laugh(folder: Path) -> str:
    (folder / "a").mkdir()
    (folder / "a" / "a.db3").touch()
    lines = ["a0: &a0 [x, x]", *(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 30))]
    told = "rosbag2_bagfile_information: {relative_file_paths: *a29, custom_data: {a: *a29}}"
    (folder / "a" / "metadata.yaml").write_text("\n".join([*lines, told]))
    return "a"


def bag_that_names_other_files(folder: Path) -> str:
    (folder / "a").mkdir()
    told = "rosbag2_bagfile_information: {relative_file_paths: [../../../../etc/passwd]}"
    (folder / "a" / "metadata.yaml").write_text(told)
    return "a"


def bag_of_a_view_without_end(folder: Path) -> str:
    with sqlite3.connect(folder / "a.db3") as base:
        base.executescript(
            "CREATE TABLE schema(schema_version); INSERT INTO schema VALUES (4);"
            "CREATE TABLE topics(id, name, type, serialization_format, offered_qos_profiles, type_description_hash);"
            "CREATE TABLE messages(id, topic_id, timestamp, data AS (zeroblob(1000000000)));"
            "CREATE VIEW message_definitions AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
            " SELECT x AS id, x AS topic_type, x AS encoding, x AS encoded_message_definition,"
            " x AS type_description_hash FROM c;"
        )
    base.close()
    return "a.db3"


def bag_of_ros1_that_unpacks_to_much(folder: Path) -> str:
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Rosbag1Writer(
        folder / "a.bag",
    )
    writer.set_compression(Rosbag1Writer.CompressionFormat.BZ2)
    with writer:
        topic = writer.add_connection("/a", "std_msgs/msg/String", typestore=store)
        writer.write(topic, 1, bytes(140 << 20))
    return "a.bag"


def trajectory_without_end(folder: Path) -> str:
    carmen_of_fine_scans(folder)
    (folder / "a.tum").write_bytes(b"1 " * 100_000)
    return "a.clf --truth a.tum"


BOMBS: tuple[Callable[[Path], str], ...] = (
    a_pipe,
    carmen_of_a_long_count,
    pictures_that_are_empty,
    bag_of_a_view_without_end,
    a_device,
    bag_that_names_other_files,
    bag_whose_metadata_laugh,
    carmen_of_bzip2,
    carmen_of_fine_scans,
    carmen_of_gzip,
    mcap_of_a_fine_scan,
    mcap_of_a_number_of_json,
    mcap_of_deep_json,
    mcap_of_empty_messages,
    mcap_of_lz4,
    mcap_of_transforms_without_end,
    mcap_that_hides_a_gigabyte,
    mcap_that_unpacks_to_a_gigabyte,
    pictures_of_a_gigapixel,
    pictures_that_are_pipes,
    bag_of_ros1_that_unpacks_to_much,
    trajectory_without_end,
)


@attack(
    family="logs",
    promise="A log that unpacks or declares without bounds takes less than 5 s and 1 GB",
    tries=len(BOMBS),
    short=4,
)
def log_bombs(seed: int, folder: Path) -> Attempt:
    bomb = BOMBS[seed % len(BOMBS)]
    name, *options = bomb(folder).split()
    learn = ["learn", name, "-o", "a.refseq", "--features", "walls,doors,boundary,sectors,hu", *options]
    checked, learnt = tried(["log", "check", name, *options], folder, (0, 1, 2)), tried(learn, folder)
    told = checked.fell or learnt.fell
    figures = {unit: max(checked.figures[unit], learnt.figures[unit]) for unit in learnt.figures}
    return Attempt(told and f"{bomb.__name__}: {told}", figures)
