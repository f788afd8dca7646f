"""BMP and WebP: size and damage by the head, before memory of that size is taken."""

import struct

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.limits import MIB
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.decoding.still import VALID

COLOUR = np.random.default_rng(2).integers(0, 255, (24, 41, 3), np.uint8)
BMP = cv2.imencode(".bmp", COLOUR)[1].tobytes()
GREY_BMP = cv2.imencode(".bmp", COLOUR[:, :, 0])[1].tobytes()
LOSSY = cv2.imencode(".webp", COLOUR, [cv2.IMWRITE_WEBP_QUALITY, 80])[1].tobytes()
LOSSLESS = cv2.imencode(".webp", COLOUR, [cv2.IMWRITE_WEBP_QUALITY, 101])[1].tobytes()


def extended(frame: bytes, width: int, height: int, flags: int = 8, orientation: int = 1) -> bytes:
    """A WebP file with a head of its own, and with an EXIF part."""
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, orientation, 0)
    exif = b"II*\0" + struct.pack("<IH", 8, 1) + entry + bytes(4)
    head = bytes([flags, 0, 0, 0]) + (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(3, "little")
    body = (
        b"WEBPVP8X" + struct.pack("<I", len(head)) + head + frame[12:] + b"EXIF" + struct.pack("<I", len(exif)) + exif
    )
    return b"RIFF" + struct.pack("<I", len(body)) + body


def changed(data: bytes, at: int, value: bytes) -> bytes:
    return data[:at] + value + data[at + len(value) :]


@pytest.mark.parametrize("pixels", [COLOUR, COLOUR[:, :, 0], np.dstack([COLOUR, COLOUR[:, :, 0]])], ids=[24, 8, 32])
@pytest.mark.parametrize("ending", [".bmp", ".webp"])
def test_the_size_by_the_head_is_that_of_the_decoded_picture(pixels: NDArray[np.uint8], ending: str) -> None:
    picture = CompressedPicture(cv2.imencode(ending, pixels)[1].tobytes())
    assert picture.check() == picture.decode().shape[::-1] == (41, 24)


def test_a_bmp_from_the_top_down_is_read() -> None:
    picture = CompressedPicture(changed(BMP, 22, struct.pack("<i", -24)))
    assert picture.check() == (41, 24)
    np.testing.assert_array_equal(picture.decode(), CompressedPicture(BMP).decode()[::-1])


@pytest.mark.parametrize("frame", [LOSSY, LOSSLESS])
@pytest.mark.parametrize("orientation", range(10))
def test_a_webp_is_of_the_size_in_which_it_is_seen(frame: bytes, orientation: int) -> None:
    picture = CompressedPicture(extended(frame, 41, 24, orientation=orientation))
    assert picture.check() == picture.decode().shape[::-1]


BOMBS = {
    "BMP": changed(BMP, 18, struct.pack("<ii", 60_000, 60_000)),
    "BMP of no height": changed(BMP, 22, bytes(4)),
    "lossy": changed(LOSSY, 26, struct.pack("<HH", 16383, 16383)),
    "lossless": changed(LOSSLESS, 21, struct.pack("<I", 16382 | 16382 << 14)),
    "extended": extended(LOSSY, 1 << 24, 1 << 24),
}


@pytest.mark.parametrize("bomb", BOMBS.values(), ids=BOMBS)
def test_what_declares_too_much_is_refused_before_it_is_decoded(bomb: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "imdecode", None)
    with pytest.raises(LogError, match=r"an image declares \d+ × \d+ pixels; valid are 1 to 67108864 pixels"):
        CompressedPicture(bomb).decode()


REFUSED = {
    "BMP longer than it is": (changed(BMP, 22, struct.pack("<i", 25)), "it ends too early: it has 3030 bytes, and its"),
    "BMP that begins late": (changed(BMP, 10, b"\xff" * 4), "it ends too early: it has 3030 bytes, and its rows end"),
    "BMP packed": (changed(BMP, 30, b"\1"), "it is a BMP of 24 bits a pixel, packed by method 1, with a head of 40"),
    "BMP of OS/2": (changed(BMP, 14, b"\x0c"), "it is a BMP of 24 bits a pixel, packed by method 0, with a head of 12"),
    "BMP of no bits": (changed(BMP, 28, b"\0"), "it is a BMP of 0 bits a pixel"),
    "BMP of too many colours": (
        changed(GREY_BMP, 46, struct.pack("<I", 257)),
        "it is a BMP of 8 bits a pixel with a list of 257 colours",
    ),
    "BMP's head alone": (BMP[:50], "it ends too early"),
    "WebP that was cut": (LOSSY[:-1], f"it ends too early: it has {len(LOSSY) - 1} bytes, and says {len(LOSSY)}"),
    "WebP that moves": (extended(LOSSY, 41, 24, flags=2), "it is a WebP that moves, or its head is damaged"),
    "WebP without a frame": (changed(LOSSY, 23, b"\0"), "its head is damaged"),
    "WebP without pixels": (extended(LOSSY[:12], 41, 24), "it has no pixels"),
    "WebP of nothing": (b"RIFF\4\0\0\0WEBP", "its head is damaged"),
    "WebP of many parts": (b"RIFF" + struct.pack("<I", 8 * MIB) + b"WEBP" + bytes(8 * MIB), "its head is damaged"),
}


@pytest.mark.parametrize(("data", "reason"), REFUSED.values(), ids=REFUSED)
def test_what_is_not_read_is_told_before_it_is_decoded(
    data: bytes, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cv2, "imdecode", None)
    with pytest.raises(LogError) as caught:
        CompressedPicture(data).decode()
    assert str(caught.value).startswith(f"an image cannot be decoded: {reason}")
    assert str(caught.value).endswith(f"; valid are {VALID}")
