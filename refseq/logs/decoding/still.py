"""Formats of single pictures beside PNG and JPEG: BMP and WebP, by what their heads declare.

Neither has sums. Either tells how many bytes it has, so that one that was cut off is told without being decoded.
"""

import struct

from refseq.errors import LogError
from refseq.logs.decoding.orientation import tiff_turns

VALID = "PNG, JPEG, WebP and BMP"
"""Formats that are read."""
BMP_MAGIC = b"BM"
BMP_HEADS = range(40, 125)
"""Lengths of the heads that are read [bytes]: Windows', since 1990."""
BMP_BITS = (1, 4, 8, 16, 24, 32)
BMP_MOST_LISTED = 8
"""Bits a pixel up to which a BMP lists its colours."""
BMP_PLAIN = (0, 3)
"""Ways of storing rows that take what their width says: as they are, and with masks of their colours."""
WEBP_HEAD = 12
WEBP_PARTS = (b"VP8X", b"VP8 ", b"VP8L", b"EXIF")
MOST_PARTS = 100
"""So many parts of a WebP file are looked at: a still one has up to seven."""
WEBP_FRAME_BEGIN = b"\x9d\x01\x2a"
WEBP_MOVES = 0x02


def is_bmp(data: bytes) -> bool:
    """Tell by the first bytes."""
    return data[:2] == BMP_MAGIC


def is_webp(data: bytes) -> bool:
    """Tell by the first bytes."""
    return data[:4] == b"RIFF" and data[8:12] == b"WEBP"


def _refused(why: str) -> LogError:
    return LogError(f"an image cannot be decoded: {why}; valid are {VALID}")


def bmp_size(data: bytes) -> tuple[int, int]:
    """Width and height of a BMP file [pixels]. Raises ``LogError`` for one of another make than Windows' plain one."""
    if len(data) < 54:
        raise _refused("it ends too early")
    head, width, height, _, bits, packing = struct.unpack_from("<IiiHHI", data, 14)
    (colours,) = struct.unpack_from("<I", data, 46)
    if bits <= BMP_MOST_LISTED and colours > 1 << bits:
        raise _refused(f"it is a BMP of {bits} bits a pixel with a list of {colours} colours")
    if head not in BMP_HEADS or bits not in BMP_BITS or packing not in BMP_PLAIN:
        raise _refused(f"it is a BMP of {bits} bits a pixel, packed by method {packing}, with a head of {head} bytes")
    return width, abs(height)


def check_bmp(data: bytes) -> None:
    """Raise ``LogError`` for a BMP file with fewer bytes than its rows take."""
    width, height = bmp_size(data)
    (begin,), (bits,) = struct.unpack_from("<I", data, 10), struct.unpack_from("<H", data, 28)
    needed = begin + (width * bits + 31) // 32 * 4 * height
    if len(data) < needed:
        raise _refused(f"it ends too early: it has {len(data)} bytes, and its rows end at {needed}")


def webp_size(data: bytes) -> tuple[int, int]:
    """Width and height of a WebP file [pixels], as it is seen. Raises ``LogError`` for one that moves or is none."""
    parts = _webp_parts(data)
    if whole := parts.get(b"VP8X"):
        if len(whole) < 10 or whole[0] & WEBP_MOVES:
            raise _refused("it is a WebP that moves, or its head is damaged")
        width, height = 1 + int.from_bytes(whole[4:7], "little"), 1 + int.from_bytes(whole[7:10], "little")
        return (height, width) if tiff_turns(parts.get(b"EXIF", b"")) else (width, height)
    lossy, lossless = parts.get(b"VP8 ", b""), parts.get(b"VP8L", b"")
    if lossy[3:6] == WEBP_FRAME_BEGIN and len(lossy) >= 10:
        width, height = struct.unpack_from("<HH", lossy, 6)
        return width & 0x3FFF, height & 0x3FFF
    if lossless[:1] == b"\x2f" and len(lossless) >= 5:
        told = int.from_bytes(lossless[1:5], "little")
        return 1 + (told & 0x3FFF), 1 + (told >> 14 & 0x3FFF)
    raise _refused("its head is damaged")


def check_webp(data: bytes) -> None:
    """Raise ``LogError`` for a WebP file that is shorter than it says, or without pixels."""
    declared = int.from_bytes(data[4:8], "little") + 8
    if len(data) < declared:
        raise _refused(f"it ends too early: it has {len(data)} bytes, and says {declared}")
    if not {b"VP8 ", b"VP8L"} & _webp_parts(data).keys():
        raise _refused("it has no pixels")


def _webp_parts(data: bytes) -> dict[bytes, bytes]:
    """Content of each part that is asked for, as far as it is there; of two of a kind the first counts."""
    found: dict[bytes, bytes] = {}
    at = WEBP_HEAD
    for _ in range(MOST_PARTS):
        kind, length = data[at : at + 4], int.from_bytes(data[at + 4 : at + 8], "little")
        if kind in WEBP_PARTS and kind not in found:
            found[kind] = data[at + 8 : at + 8 + length]
        at += 8 + length + length % 2
    return found
