"""Pictures of a log, decoded to grey only when asked: PNG, JPEG, WebP, BMP and the usual raw encodings."""

import os
import re
import struct
import tempfile
import threading
import zlib
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.limits import JPEG_PASSES, PICTURE_BYTES, PIXELS
from refseq.logs.decoding.orientation import is_turned
from refseq.logs.decoding.still import VALID, bmp_size, check_bmp, check_webp, is_bmp, is_webp, webp_size
from refseq.logs.decoding.unpacking import translating

DEPTH_ENCODINGS = frozenset({"16uc1", "32fc1", "compresseddepth"})
"""Encodings of distances, which are no pictures."""


class DepthPictureError(LogError):
    """A picture is whole, and of distances: 16 bits, where others of its camera have 8."""


@dataclass(frozen=True, slots=True)
class _RawLayout:
    """Raw pixels: bytes a pixel, and OpenCV's conversion to grey, None where they are grey."""

    bytes: int
    conversion: int | None = None


RAW_ENCODINGS = {
    "mono8": _RawLayout(1),
    "8uc1": _RawLayout(1),
    "mono16": _RawLayout(2),
    "rgb8": _RawLayout(3, cv2.COLOR_RGB2GRAY),
    "bgr8": _RawLayout(3, cv2.COLOR_BGR2GRAY),
    "8uc3": _RawLayout(3, cv2.COLOR_BGR2GRAY),
    "rgba8": _RawLayout(4, cv2.COLOR_RGBA2GRAY),
    "bgra8": _RawLayout(4, cv2.COLOR_BGRA2GRAY),
    "8uc4": _RawLayout(4, cv2.COLOR_BGRA2GRAY),
    "bayer_rggb8": _RawLayout(1, cv2.COLOR_BayerRGGB2GRAY),
    "bayer_bggr8": _RawLayout(1, cv2.COLOR_BayerBGGR2GRAY),
    "bayer_gbrg8": _RawLayout(1, cv2.COLOR_BayerGBRG2GRAY),
    "bayer_grbg8": _RawLayout(1, cv2.COLOR_BayerGRBG2GRAY),
    "yuv422": _RawLayout(2, cv2.COLOR_YUV2GRAY_UYVY),
    "uyvy": _RawLayout(2, cv2.COLOR_YUV2GRAY_UYVY),
    "yuv422_yuy2": _RawLayout(2, cv2.COLOR_YUV2GRAY_YUY2),
    "yuyv": _RawLayout(2, cv2.COLOR_YUV2GRAY_YUY2),
}
"""Raw encodings by their names in ROS and Foxglove, in lower case."""


class LazyPicture(Protocol):
    """A picture that is not decoded yet; ``encoding`` is its format in the log's words."""

    @property
    def encoding(self) -> str:
        """Format in the log's words: ``png``, ``jpeg``, ``bgr8``, ``h264``."""
        ...

    @property
    def is_depth(self) -> bool:
        """Distances instead of brightness: no picture for place recognition."""
        ...

    def decode(self) -> NDArray[np.uint8]:
        """Grey pixels, (height, width). Raises ``LogError`` without the topic's name, which the caller adds."""
        ...


@runtime_checkable
class CheckedPicture(LazyPicture, Protocol):
    """A picture that tells its size, and most of its damage, without being decoded."""

    @property
    def name(self) -> str:
        """Name of its file; empty for one that lies in a log."""
        ...

    def check(self) -> tuple[int, int]:
        """Width and height [pixels]. Raises ``LogError`` for a picture that is damaged."""
        ...


@dataclass(frozen=True, slots=True)
class CompressedPicture:
    """A PNG, JPEG, WebP or BMP file in memory."""

    data: bytes
    encoding: str = ""
    name = ""  # it lies in a log

    @property
    def is_depth(self) -> bool:
        """PNG of one channel of 16 bits, as depth cameras are compressed, or a format that says so.

        One whose format says that it is of brightness is none.
        """
        said = self.encoding.lower().replace(";", " ").split()
        deep = self.data[:8] == PNG_MAGIC and self.data[24:26] == b"\x10\x00"
        return any(word in DEPTH_ENCODINGS for word in said) or (deep and "mono16" not in said)

    def check(self) -> tuple[int, int]:
        """Width and height [pixels], by the head.

        Raises ``LogError`` for what is no such file, declares too much, or is damaged by what its own sums tell. No
        pixel is decoded. Only PNG has sums, and of a JPEG that is damaged between its head and its end enough is seen.
        """
        PICTURE_BYTES.check(len(self.data), "an image has")
        width, height = declared_size(self.data)
        check_size(width, height)
        if self.data[:3] == JPEG_MAGIC:
            JPEG_PASSES.check(self.data.count(JPEG_PASS), "an image has")
            if self.data.rfind(JPEG_END) <= self.data.rfind(JPEG_PASS):
                raise LogError(f"an image cannot be decoded: it ends too early; valid are {VALID}")
        elif is_bmp(self.data):
            check_bmp(self.data)
        elif is_webp(self.data):
            check_webp(self.data)
        else:
            check_chunks(self.data)
        return width, height

    def decode(self) -> NDArray[np.uint8]:
        """Grey pixels. Raises ``LogError`` for what is no such file, is damaged, or declares too many pixels."""
        self.check()
        with translating(lambda reason: LogError(f"an image cannot be decoded: {reason}")):
            image, told = _decoded(self.data)
        if image is None or "libpng error: " in told:  # a damaged JPEG, as cheap cameras send them, is an image
            raise LogError(f"an image cannot be decoded{_reason(told)}; valid are {VALID}")
        return np.asarray(image, np.uint8)


def damage(picture: LazyPicture) -> str:
    """The reason for which a picture cannot be decoded, as far as ``check`` tells; empty where it may be."""
    try:
        if isinstance(picture, CheckedPicture):
            picture.check()
    except LogError as error:
        return str(error)
    return ""


@dataclass(frozen=True, slots=True)
class RawPicture:
    """Pixels by rows of ``step`` bytes each; 16-bit values are little-endian unless ``big_endian``."""

    data: bytes
    encoding: str
    width: int
    height: int
    step: int
    big_endian: bool = False
    name = ""  # it lies in a log

    @property
    def is_depth(self) -> bool:
        """16 bits or floats of one channel, by the encoding's name."""
        return self.encoding.lower() in DEPTH_ENCODINGS

    def check(self) -> tuple[int, int]:
        """Width and height [pixels]. Raises ``LogError`` for sizes that do not fit the data.

        An encoding that is not read is no damage: no picture of its topic is.
        """
        layout = RAW_ENCODINGS.get(self.encoding.lower())
        if layout is not None:
            self._check_rows(self.width * layout.bytes)
        return self.width, self.height

    def _check_rows(self, row: int) -> None:
        check_size(self.width, self.height)
        if self.step < row or len(self.data) < self.step * (self.height - 1) + row:
            raise LogError(
                f"an image of {self.width} × {self.height} {self.encoding} has {len(self.data)} bytes and rows of "
                f"{self.step}; valid are at least {row * self.height} bytes and rows of {row}"
            )

    def decode(self) -> NDArray[np.uint8]:
        """Grey pixels.

        Grey of 16 bits, of which cameras use 10 to 16, is stretched to the darkest and lightest pixel. Raises
        ``LogError`` for an encoding that is not read, and for sizes that do not fit the data.
        """
        layout = RAW_ENCODINGS.get(self.encoding.lower())
        if layout is None:
            raise LogError(f"encoding {self.encoding!r} is not read; valid are {', '.join(RAW_ENCODINGS)}, {VALID}")
        row = self.width * layout.bytes
        self._check_rows(row)
        step = self.step if self.height > 1 else row
        rows = np.zeros(step * self.height, np.uint8)  # the last row may end before its padding
        rows[: len(self.data)] = np.frombuffer(self.data, np.uint8)[: len(rows)]
        pixels = np.ascontiguousarray(rows.reshape(self.height, step)[:, :row])
        if self.encoding.lower() == "mono16":
            return _stretched(pixels.view(">u2" if self.big_endian else "<u2"))
        if layout.conversion is None:
            return pixels
        pixels = pixels.reshape(self.height, self.width, layout.bytes) if layout.bytes > 1 else pixels
        with translating(
            lambda reason: LogError(f"an image of {self.width} × {self.height} {self.encoding}: {reason}")
        ):
            return np.asarray(cv2.cvtColor(pixels, layout.conversion), np.uint8)


PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
CHUNK_FRAME = 12
"""Bytes of a part of a PNG file beside what it declares: its length, kind and checksum."""
JPEG_MAGIC = b"\xff\xd8\xff"
JPEG_PASS = b"\xff\xda"
"""Begins each pass over a JPEG's pixels; within their data there is a zero behind 0xff."""
JPEG_END = b"\xff\xd9"


def check_size(width: int, height: int) -> None:
    """Raise ``LogError`` for a size that is no picture's, before anything of that size is allocated."""
    if width <= 0 or height <= 0 or width * height > PIXELS:
        raise LogError(f"an image declares {width} × {height} pixels; valid are 1 to {int(PIXELS)} pixels")


def declared_size(data: bytes) -> tuple[int, int]:
    """Width and height by the head of a picture's file, as it is seen. Raises ``LogError`` for any other."""
    if data[:8] == PNG_MAGIC and len(data) >= 26:
        width, height = struct.unpack(">II", data[16:24])
        return width, height
    if data[:3] == JPEG_MAGIC:
        width, height = _jpeg_size(data)
        return (height, width) if is_turned(data) else (width, height)
    if is_bmp(data):
        return bmp_size(data)
    if is_webp(data):
        return webp_size(data)
    raise LogError(f"an image cannot be decoded; valid are {VALID}")


def check_chunks(data: bytes) -> None:
    """Raise ``LogError`` where a PNG file ends too early, or a part of it is not what its sum tells.

    A part that declares more bytes than are left OpenCV would allocate.
    """
    at, kind, parts = len(PNG_MAGIC), b"", set[bytes]()
    while at < len(data) and kind != b"IEND":
        declared, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        left = max(0, len(data) - at - CHUNK_FRAME)
        if declared > left:
            raise LogError(f"an image cannot be decoded: a part of it declares {declared} bytes, and {left} are left")
        end = at + 8 + declared
        if kind.isupper() and zlib.crc32(data[at + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            raise LogError(
                f"an image cannot be decoded: its part {kind.decode('latin-1')!r} is damaged; valid are {VALID}"
            )
        parts.add(kind)
        at += CHUNK_FRAME + declared
    if not {b"IDAT", b"IEND"} <= parts:
        raise LogError(f"an image cannot be decoded: it ends too early; valid are {VALID}")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    """Size in the frame header, found by walking from marker to marker."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # a fill byte
            at += 1
        elif 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        else:
            at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    raise LogError(f"an image cannot be decoded; valid are {VALID}")


LIBRARIES = re.compile(
    rb"libpng|libjpeg|.*JPEG|Corrupt|Premature|Invalid|Inconsistent|Unknown Adobe|Unsupported|Warning|"
    rb"\[ *(WARN|ERROR|INFO)|\s*$"
)
"""Lines that libpng, libjpeg and OpenCV print begin so, or are empty."""

_decoding = threading.Lock()


def _decoded(data: bytes) -> tuple[Any, str]:
    """OpenCV's grey image, None for damage; and what the libraries below it have printed, for they do not raise.

    What other threads print meanwhile is printed behind.
    """
    with _decoding, tempfile.TemporaryFile() as heard:
        stderr = os.dup(2)
        os.dup2(heard.fileno(), 2)
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
        heard.seek(0)
        lines = heard.read().splitlines(keepends=True)
    theirs = [line for line in lines if LIBRARIES.match(line)]
    if others := [line for line in lines if not LIBRARIES.match(line)]:
        os.write(2, b"".join(others))
    return image, b"".join(theirs)[:1000].decode(errors="replace")


def _reason(told: str) -> str:
    first = next(iter(told.splitlines()), "")
    return f": {first:.80}" if first else ""


def _stretched(pixels: NDArray[np.uint16]) -> NDArray[np.uint8]:
    low, high = int(pixels.min()), int(pixels.max())
    scaled = (pixels.astype(np.float32) - low) * (255.0 / max(1, high - low))
    return scaled.round().astype(np.uint8)
