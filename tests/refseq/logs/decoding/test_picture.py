import os
import struct
import threading

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.decoding.picture import PNG_MAGIC, RAW_ENCODINGS, CompressedPicture, RawPicture, damage

GREY = cv2.GaussianBlur(np.random.default_rng(4).integers(0, 256, (24, 32), np.uint8), (0, 0), 3)


def raw(encoding: str, pixels: NDArray[np.generic], pad: int = 0, big_endian: bool = False) -> RawPicture:
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(pixels.shape[0], -1)
    padded = np.pad(rows, ((0, 0), (0, pad)), constant_values=99)
    return RawPicture(padded.tobytes(), encoding, pixels.shape[1], pixels.shape[0], padded.shape[1], big_endian)


@pytest.mark.parametrize("pad", [0, 7])
@pytest.mark.parametrize("encoding", ["mono8", "8UC1"])
def test_grey_is_taken_as_it_is_whatever_follows_a_row(encoding: str, pad: int) -> None:
    np.testing.assert_array_equal(raw(encoding, GREY, pad).decode(), GREY)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "8UC3", "rgba8", "bgra8", "8UC4"])
def test_a_grey_scene_in_colour_is_the_same_grey(encoding: str) -> None:
    channels = RAW_ENCODINGS[encoding.lower()].bytes
    np.testing.assert_allclose(raw(encoding, np.repeat(GREY[:, :, None], channels, axis=2), 5).decode(), GREY, atol=1)


@pytest.mark.parametrize(("encoding", "red"), [("rgb8", 0), ("bgr8", 2), ("rgba8", 0), ("bgra8", 2)])
def test_red_weighs_as_in_bt_601(encoding: str, red: int) -> None:
    pixels = np.zeros((4, 4, RAW_ENCODINGS[encoding].bytes), np.uint8)
    pixels[:, :, red] = 200
    np.testing.assert_allclose(raw(encoding, pixels).decode(), 0.299 * 200, atol=1)


@pytest.mark.parametrize(("pattern", "corner"), [("rggb", 0), ("bggr", 3), ("gbrg", 2), ("grbg", 1)])
def test_each_bayer_pattern_puts_red_where_it_is(pattern: str, corner: int) -> None:
    """A red scene lights the red pixels of the mosaic; its grey is that of red."""
    mosaic = np.zeros((16, 16), np.uint8)
    mosaic[corner // 2 :: 2, corner % 2 :: 2] = 200
    grey = raw(f"bayer_{pattern}8", mosaic).decode()
    assert grey[4:-4, 4:-4].mean() == pytest.approx(0.299 * 200, abs=3)


@pytest.mark.parametrize(("encoding", "luma"), [("yuv422", 1), ("uyvy", 1), ("yuv422_yuy2", 0), ("yuyv", 0)])
def test_the_luma_of_yuv_is_the_grey(encoding: str, luma: int) -> None:
    pixels = np.full((24, 32, 2), 128, np.uint8)
    pixels[:, :, luma] = GREY
    np.testing.assert_array_equal(raw(encoding, pixels, 3).decode(), GREY)


@pytest.mark.parametrize("big_endian", [False, True])
def test_sixteen_bits_are_stretched_to_eight(big_endian: bool) -> None:
    twelve = GREY.astype(np.uint16) * 16 + 100  # a camera of 12 bits
    stored = twelve.astype(">u2" if big_endian else "<u2")
    expected = (GREY.astype(float) - GREY.min()) * 255 / np.ptp(GREY)
    np.testing.assert_allclose(raw("mono16", stored, 2, big_endian).decode(), expected, atol=0.51)


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_depth_says_so(encoding: str) -> None:
    assert RawPicture(b"", encoding, 0, 0, 0).is_depth
    assert not raw("mono16", GREY.astype(np.uint16)).is_depth


def test_a_png_of_sixteen_bits_is_depth() -> None:
    data = cv2.imencode(".png", GREY.astype(np.uint16) * 9)[1].tobytes()
    assert CompressedPicture(data, "png").is_depth
    assert CompressedPicture(b"", "16UC1; compressedDepth png").is_depth
    assert not CompressedPicture(cv2.imencode(".png", GREY)[1].tobytes(), "png").is_depth


def test_a_single_row_may_declare_any_step() -> None:
    assert RawPicture(bytes(3), "mono8", 3, 1, 1 << 40).decode().shape == (1, 3)


@pytest.mark.parametrize("kind", [".png", ".jpg"])
def test_compressed_pictures_are_decoded(kind: str) -> None:
    picture = CompressedPicture(cv2.imencode(kind, GREY)[1].tobytes())
    np.testing.assert_allclose(picture.decode().astype(int), GREY, atol=0 if kind == ".png" else 6)


def png_of(width: int, height: int) -> bytes:
    data = bytearray(cv2.imencode(".png", GREY)[1].tobytes())
    data[16:24] = struct.pack(">II", width, height)
    return bytes(data)


def png_with_a_part_of(count: int) -> bytes:
    """A PNG file whose pixels are said to take ``count`` bytes."""
    data = bytearray(cv2.imencode(".png", GREY)[1].tobytes())
    at = data.index(b"IDAT") - 4
    data[at : at + 4] = struct.pack(">I", count)
    return bytes(data)


def jpeg_of(width: int, height: int) -> bytes:
    data = bytearray(cv2.imencode(".jpg", GREY)[1].tobytes())
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", height, width)
    return bytes(data)


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (CompressedPicture(b"GIF89a" + bytes(40)), "an image cannot be decoded; valid are PNG, JPEG, WebP and BMP"),
        (
            CompressedPicture(b"\x89PNG\r\n\x1a\n" + bytes(40)),
            "an image declares 0 × 0 pixels; valid are 1 to",
        ),
        (CompressedPicture(png_of(60_000, 60_000)), "an image declares 60000 × 60000 pixels; valid are 1 to 67108864"),
        (CompressedPicture(jpeg_of(60_000, 60_000)), "an image declares 60000 × 60000 pixels; valid are 1 to 67108864"),
        (
            CompressedPicture(png_with_a_part_of(1 << 31)),
            "an image cannot be decoded: a part of it declares 2147483648",
        ),
        (CompressedPicture(b"\xff\xd8\xff\xe0"), "an image cannot be decoded; valid are PNG, JPEG, WebP and BMP"),
        (RawPicture(bytes(9), "nv21", 3, 3, 3), "encoding 'nv21' is not read; valid are mono8, 8uc1, mono16, rgb8"),
        (RawPicture(bytes(9), "rgb8", 3, 3, 9), "an image of 3 × 3 rgb8 has 9 bytes and rows of 9; valid are at least"),
        (RawPicture(bytes(99), "rgb8", 3, 3, 8), "an image of 3 × 3 rgb8 has 99 bytes and rows of 8; valid are at l"),
        (RawPicture(bytes(9), "mono8", 1 << 31, 1 << 31, 1 << 31), "an image declares 2147483648 × 2147483648 pix"),
        (RawPicture(bytes(2), "mono8", 3, 1, 1 << 40), "an image of 3 × 1 mono8 has 2 bytes and rows of 1099511627776"),
        (RawPicture(bytes(9), "mono8", 3, 3, 1 << 40), "an image of 3 × 3 mono8 has 9 bytes and rows of 1099511627776"),
    ],
)
def test_pictures_that_are_none(picture: CompressedPicture | RawPicture, message: str) -> None:
    with pytest.raises(LogError) as caught:
        picture.decode()
    assert str(caught.value).startswith(message)
    assert damage(picture) == ("" if "is not read" in message else str(caught.value)), "told without decoding as well"


@pytest.fixture(scope="module", params=[".png", ".jpg", ".bmp", ".webp"])
def picture_file(request: pytest.FixtureRequest) -> bytes:
    pixels = np.random.default_rng(3).integers(0, 256, (120, 160), np.uint8)
    return cv2.imencode(request.param, pixels)[1].tobytes()


def test_a_whole_picture_is_not_damaged(picture_file: bytes) -> None:
    assert damage(CompressedPicture(picture_file)) == ""


def test_a_picture_that_ends_too_early_is_damaged_wherever_it_ends(picture_file: bytes) -> None:
    for end in [*range(1, len(picture_file), 211), len(picture_file) - 1]:
        assert damage(CompressedPicture(picture_file[:end])), end


def test_whichever_byte_is_changed_a_png_is_found_damaged_or_decoded(picture_file: bytes) -> None:
    """The others have no sums: one whose tables were hit may be refused when it is decoded, and by nothing but that."""
    found = 0
    for at in [*range(len(picture_file) % 7, 120), *range(120, len(picture_file), 499)]:
        data = bytearray(picture_file)
        data[at] ^= 0x80
        picture = CompressedPicture(bytes(data))
        if damage(picture):
            found += 1
            continue
        try:
            assert picture.decode().ndim == 2
        except LogError:
            assert picture_file[:8] != PNG_MAGIC
    assert found > 5


def test_what_other_threads_tell_while_pictures_are_decoded_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    data = cv2.imencode(".png", np.random.default_rng(0).integers(0, 255, (240, 320), np.uint8))[1].tobytes()
    told, done = 0, threading.Event()

    def tell() -> None:
        nonlocal told
        while not done.is_set():
            told += os.write(2, b"a line\n") > 0

    teller = threading.Thread(target=tell)
    teller.start()
    for _ in range(20):
        CompressedPicture(data, "png").decode()
    done.set()
    teller.join()
    assert capfd.readouterr().err.count("a line\n") == told > 0
