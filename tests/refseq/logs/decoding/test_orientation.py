"""Orientation in a JPEG's EXIF: the size that is told without decoding is that of the decoded picture."""

import struct

import cv2
import numpy as np
import pytest

from refseq.logs.decoding.orientation import is_turned
from refseq.logs.decoding.picture import CompressedPicture

PICTURE = np.random.default_rng(1).integers(0, 255, (24, 40), np.uint8)


def held(orientation: int, order: str = "<", before: bytes = b"") -> bytes:
    """A JPEG of 40 × 24 pixels whose camera was held so."""
    head = {"<": b"II", ">": b"MM"}[order] + struct.pack(f"{order}HI", 42, 8)
    entries = struct.pack(f"{order}HHIHHHHIHH", 0x0100, 3, 1, 40, 0, 0x0112, 3, 1, orientation, 0)
    tiff = head + struct.pack(f"{order}H", 2) + entries + struct.pack(f"{order}I", 0)
    exif = b"Exif\0\0" + tiff
    whole = cv2.imencode(".jpg", PICTURE)[1].tobytes()
    return whole[:2] + before + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + whole[2:]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(10))
def test_the_size_by_the_head_is_that_of_the_decoded_picture(orientation: int, order: str) -> None:
    picture = CompressedPicture(held(orientation, order))
    assert picture.check() == picture.decode().shape[::-1]
    assert is_turned(picture.data) is (5 <= orientation <= 8)


def test_the_part_may_stand_behind_others() -> None:
    other = b"\xff\xe1" + struct.pack(">H", 9) + b"http://"
    picture = CompressedPicture(held(6, before=other))
    assert picture.check() == picture.decode().shape[::-1] == (24, 40)


def test_a_part_that_ends_anywhere_is_no_error() -> None:
    whole = held(6)
    for end in range(len(whole)):
        assert is_turned(whole[:end]) in (True, False)
    for at in range(2, 60):
        assert is_turned(whole[:at] + b"\xff" + whole[at + 1 :]) in (True, False)
    assert not is_turned(cv2.imencode(".jpg", PICTURE)[1].tobytes())
