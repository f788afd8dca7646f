"""Bounds on what a file may declare or hold, each far above what real robots and their sensors need.

Readers ask before they allocate or decode anything of that size. ``docs/limits.md`` shows all of them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

from refseq.errors import LogError

MIB = 1 << 20


class Limit(int):
    """The most that is valid of a ``unit``; ``why`` tells what real files have."""

    unit: str
    why: str

    def __new__(cls, most: int, unit: str, why: str) -> Self:
        """Make a number with its meaning."""
        made = super().__new__(cls, most)
        made.unit, made.why = unit, why
        return made

    def check(self, found: float, what: str, error: type[Exception] = LogError) -> None:
        """Raise ``error`` for more than the limit; ``what`` names the place and ends with a verb, 'a.mcap: has'."""
        if not found <= self:
            raise error(f"{what} {found} {self.unit}; valid are at most {int(self)}")

    @property
    def text(self) -> str:
        """The bound, for the table."""
        return _grouped(self)


@dataclass(frozen=True, slots=True)
class Share:
    """At most ``free`` of a ``unit``, and ``per_byte`` more for each byte of the file; ``why`` as of a ``Limit``.

    It bounds what small files may unpack to, and leaves large ones room.
    """

    free: int
    per_byte: float
    unit: str
    why: str

    def of(self, path: Path) -> "TotalSize":
        """Begin to count what a file gives."""
        return TotalSize(self, path)

    @property
    def text(self) -> str:
        """The bound, for the table."""
        more = f"{self.per_byte:g} a byte" if self.per_byte >= 1 else f"one in {1 / self.per_byte:g} bytes"
        return f"{_grouped(self.free)}, and {more} of the file"


class TotalSize:
    """Count of what a file has given so far."""

    def __init__(self, share: Share, path: Path) -> None:
        self._share, self._path, self._found = share, path, 0
        self._size = path.stat().st_size

    @property
    def left(self) -> int:
        """The rest that the file may give."""
        return int(self._share.free + self._share.per_byte * self._size) - self._found

    def add(self, count: int) -> None:
        """Count. Raises ``LogError`` beyond the share."""
        self._found += count
        if self.left < 0:
            raise LogError(
                f"{self._path}: holds more than {self._found + self.left} {self._share.unit} in {self._size} bytes; "
                f"valid are {self._share.text}"
            )


def _grouped(number: int) -> str:
    return f"{number:,}".replace(",", "\u202f")


BEAMS = Limit(100_000, "ranges in a scan", "the finest planar lasers have 25 200 a turn")
PIXELS = Limit(1 << 26, "pixels in a picture", "cameras of robots have up to 12 million")
PICTURE_BYTES = Limit(128 * MIB, "bytes of a picture", "36 million hold 12 million pixels of colour, not packed")
JPEG_PASSES = Limit(100, "passes in a JPEG picture", "progressive ones have 10; each goes over all pixels")
VIDEO_FRAMES = Limit(10_000, "frames of a video that depend on one key frame", "encoders put one in every 250")
CHUNK_BYTES = Limit(128 * MIB, "bytes in a chunk or message, unpacked", "recorders cut chunks at 1 to 4 MiB")
MESSAGE_BYTES = Limit(4 * MIB, "bytes in a message that is no picture", "25 200 ranges with intensities take 200 000")
JSON_BYTES = Limit(16 * MIB, "bytes in a message of JSON", "12 million pixels, packed, take 10 million")
UNPACKED_BYTES = Share(64 * MIB, 500, "bytes, unpacked", "flat pictures of simulators pack to a 200th")
UNPACKED_TEXT = Share(16 * MIB, 100, "characters of text, unpacked", "scans of a robot that stands pack to a 50th")
MESSAGES = Share(100_000, 1 / 8, "messages or lines of a log", "a heartbeat of 4 bytes takes 12 on disk, packed")
LINE_BYTES = Limit(MIB, "bytes in a line of a CARMEN log", "25 200 ranges take 150 000")
ROW_BYTES = Limit(1 << 16, "bytes in a line of a trajectory or table", "rows of poses take 200")
ROWS = Limit(2_000_000, "rows in a trajectory or table", "poses at 200 Hz for an hour are 720 000")
FILES = Limit(1_000_000, "files in a folder", "the longest drive of the data sets has 36 000 pictures")
TOPICS = Limit(10_000, "topics in a log", "large robots have a thousand")
FRAMES = Limit(4096, "coordinate frames in a log", "humanoids with hands have 200")
METADATA_BYTES = Limit(4 * MIB, "bytes in a bag's metadata", "a thousand topics take a million")
METRES = Limit(10**9, "metres from the origin", "coordinates of UTM and of the earth's centre are below 10 million")
SECONDS = Limit(2**33, "seconds from the year 1970", "this is the year 2242")
ARRAY_BYTES = Limit(256 * MIB, "bytes of a ground truth's array", "16 000 × 16 000 pictures as booleans")
RIGHT_PICTURES = Limit(1 << 22, "right pictures in a ground truth", "the largest data set has 600 000")

MAP_BYTES = Limit(512 * MIB, "bytes of a map's arrays, unpacked", "10 km and two million SIFT words take 300 MB")
MAP_HEADER_BYTES = Limit(16 * MIB, "bytes of a map's header", "annotations of a hundred paths take 1 MB")
MAP_DIRECTORY_BYTES = Limit(
    4 * MIB, "bytes of the list of files in a map", "maps have 30 files a path, of 100 bytes each"
)
MAP_PLACES = Limit(10_000_000, "places of a map", "10 km have 12 000")
MAP_FEATURES = Limit(100_000_000, "features of a sequence", "10 km have two million")
MAP_METRES = Limit(10**9, "metres in a map, either side of 0", "coordinates of the earth are below 10 million")
BELIEF_BYTES = Limit(512 * MIB, "bytes of a table of beliefs, unpacked", "10 000 views of 1 000 places take 80 MB")
PARQUET_FOOTER_BYTES = Limit(MIB, "bytes of a Parquet file's footer", "20 columns of 50 million rows take 250 000")
NETWORK_BYTES = Limit(512 * MIB, "bytes of a network that finds keys", "those that run on robots have 3 to 50 million")
SCENE_BYTES = Limit(8 * MIB, "bytes of a scene", "a whole picture of 640 × 480 takes 250 000")


def all_limits() -> dict[str, Limit | Share]:
    """Limits by name, in the order above."""
    return {name: one for name, one in globals().items() if isinstance(one, Limit | Share)}
