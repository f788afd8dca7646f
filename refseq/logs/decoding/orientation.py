"""Orientation of a picture as its camera was held, in its EXIF: phones store turned pictures, and say so there."""

import struct

EXIF, MARKER = b"Exif\0\0", 0xE1
"""Head of the part that holds it, and that part's marker."""
TAG, SHORT = 0x0112, 3
"""Tag of the orientation, and its type: a number of two bytes."""
TURNED = range(5, 9)
"""Orientations by a quarter of a turn: width and height of what is seen are those of the file exchanged."""


def is_turned(data: bytes) -> bool:
    """Tell whether a JPEG is to be seen with its width and height exchanged, as OpenCV decodes it.

    An EXIF part that cannot be read tells nothing.
    """
    at = 2
    while data[at : at + 1] == b"\xff" and at + 4 <= len(data):
        marker, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        if marker == 0xFF:  # a fill byte
            at += 1
            continue
        part = data[at + 4 : at + 2 + length]
        if marker == MARKER and part.startswith(EXIF):
            return tiff_turns(part[len(EXIF) :])
        if marker == 0xDA:  # pixels follow
            return False
        at += 2 + length
    return False


def tiff_turns(tiff: bytes) -> bool:
    """Tell the same of a TIFF head alone, as WebP files have it."""
    return _orientation(tiff) in TURNED


def _orientation(tiff: bytes) -> int:
    """The orientation in a TIFF head, 1 to 8; 0 where there is none."""
    order = {b"II": "<", b"MM": ">"}.get(tiff[:2])
    if order is None or len(tiff) < 8:
        return 0
    try:
        (begin,) = struct.unpack_from(f"{order}I", tiff, 4)
        (count,) = struct.unpack_from(f"{order}H", tiff, begin)
        for number in range(count):
            tag, kind, _, value = struct.unpack_from(f"{order}HHIH", tiff, begin + 2 + 12 * number)
            if tag == TAG and kind == SHORT:
                return int(value)
    except struct.error:  # it ends too early
        return 0
    return 0
