import cv2
import numpy as np
import pytest

from refseq.features.dense import DenseSettings, DenseWords, describe_patches, local_deviation
from refseq.map.extractors import make_extractor
from refseq.map.profile import BEST
from refseq.view import View

A_VIEW = 8 * 6 * 8


def texture(seed: int = 0, height: int = 480, width: int = 640) -> np.ndarray:
    """Blobs of several sizes, from 40 to 210 so that light may change without clipping."""
    rng = np.random.default_rng(seed)
    layers = [cv2.resize(rng.random((n, n)), (width, height), interpolation=cv2.INTER_CUBIC) for n in (8, 20, 45)]
    return np.clip(40 + sum(layers) / 3 * 170, 0, 255).astype(np.uint8)


def dense(**settings: int) -> DenseWords:
    return DenseWords("camera", DenseSettings(**settings))


def seen(image: np.ndarray) -> View:
    return View(0.0, {"camera": image})


def shared(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the first image's words that the second one shows."""
    words = dense().words_of(one)
    return len(np.intersect1d(words, dense().words_of(other))) / len(words)


@pytest.mark.parametrize(("gain", "offset"), [(0.3, 10), (0.5, 0), (0.7, 60), (1.0, 40), (1.2, 0)])
def test_a_change_of_brightness_and_contrast_keeps_the_words(gain: float, offset: float) -> None:
    image = texture()
    changed = gain * image + offset
    assert changed.max() < 255.5  # no clipping
    assert shared(image, np.round(changed).astype(np.uint8)) > 0.9


def test_another_picture_has_other_words() -> None:
    """A winner of 16 is the same by chance in one case of 16; more often where the textures are alike."""
    assert np.mean([shared(texture(k), texture(k + 1)) for k in range(4)]) < 0.5


def test_words_tell_where_in_the_image_something_is() -> None:
    image = texture()
    assert shared(image, np.roll(image, 80, axis=1)) < 0.55  # by a patch
    assert shared(image, np.roll(image, 2, axis=1)) > 0.85


def test_a_change_in_one_half_keeps_the_words_far_from_it() -> None:
    image, other = texture(0), texture(1)
    other[:, 320:] = image[:, 320:]
    words = dense().words_of(image).reshape(6, 8, 8)
    kept = np.isin(words, dense().words_of(other)).mean(axis=(0, 2))
    assert kept[6:].min() == 1  # a descriptor looks beyond its patch
    assert kept[:2].max() < 0.6


@pytest.mark.parametrize("value", [0, 128, 255])
def test_a_blank_image_has_no_words(value: int) -> None:
    words = dense()
    blank = np.full((480, 640), value, np.uint8)
    assert len(words.learn(seen(blank))) == 0
    assert len(words.observe(seen(blank)).ids) == 0
    assert words.size == 0


def test_blank_patches_have_no_words_and_the_others_keep_theirs() -> None:
    """The left half is a wall with a camera's noise: patches 0 to 2 of 8 see nothing else in their middle."""
    image = texture()
    half = image.copy()
    half[:, :320] = 90 + np.random.default_rng(5).integers(-1, 2, (480, 320))
    place = dense().words_of(half) // (8 * 16)
    assert set(place.tolist()) == {8 * row + column for row in range(6) for column in range(3, 8)}
    right = dense().words_of(image).reshape(6, 8, 8)[:, 6:].ravel()
    assert np.isin(right, dense().words_of(half)).all()


def test_contrast_is_the_deviation_in_the_middle_of_a_patch() -> None:
    rng = np.random.default_rng(6)
    image = (100 + 25 * rng.standard_normal((240, 320))).clip(0, 255).astype(np.uint8)
    for side in (3, 16):
        y, x = 100, 60
        inside = image[y - side // 2 : y - side // 2 + side, x - side // 2 : x - side // 2 + side]
        assert local_deviation(image, side)[y, x] == pytest.approx(inside.std(), rel=1e-3)
    # A wave of amplitude a has the deviation a / √2, and whole waves fit into the 48 pixels of the middle.
    for amplitude, patches in ((2, 0), (4, 48)):
        waves = 100 + amplitude * np.sin(np.arange(320) * 2 * np.pi / 16)
        striped = np.tile(waves.round().astype(np.uint8), (240, 1))
        assert len(describe_patches(cv2.SIFT.create(), striped, DenseSettings()).numbers) == patches


@pytest.mark.parametrize(
    "size", [(480, 640), (120, 160), (96, 128), (1200, 1600), (481, 643), (200, 800), (24, 32), (1, 1), (1, 900)]
)
def test_images_of_any_size_have_words_of_their_own(size: tuple[int, int]) -> None:
    image = texture(2, *size)
    words = dense().words_of(image)
    assert len(words) <= A_VIEW
    assert len(words) == A_VIEW or min(size) < 100
    assert (np.diff(words) > 0).all()  # patch by patch and code by code, each once


def test_the_resolution_changes_few_words() -> None:
    image = texture(3)
    assert shared(image, cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA)) > 0.8


def test_patches_are_numbered_row_by_row() -> None:
    """A bright spot in the second patch of the third row, 40 pixels wide each, is in that patch alone."""
    image = np.zeros((240, 320), np.uint8)
    image[95:105, 55:65] = 200
    settings = DenseSettings(middle=20)
    patches = describe_patches(cv2.SIFT.create(), image, settings)
    assert list(patches.numbers) == [2 * 8 + 1]
    assert patches.descriptors.shape == (1, 128)


def test_words_are_the_winners_among_the_entries_drawn() -> None:
    """Of one patch, by hand: which of 16 entries is the largest, for each of 5 draws."""
    settings = DenseSettings(columns=1, rows=1, codes=5)
    image = texture(4)
    (descriptor,) = describe_patches(cv2.SIFT.create(), image, settings).descriptors
    rng = np.random.default_rng(settings.seed)
    expected = [16 * code + int(np.argmax(descriptor[rng.permutation(128)[:16]])) for code in range(5)]
    assert list(DenseWords("camera", settings).words_of(image)) == expected


@pytest.mark.parametrize("settings", [{"columns": 3, "rows": 2}, {"codes": 4}, {"among": 4}])
def test_settings_bound_the_number_of_words(settings: dict[str, int]) -> None:
    s = DenseSettings(**settings)
    words = dense(**settings).words_of(texture())
    assert len(words) == s.columns * s.rows * s.codes
    assert 0 <= words.min() <= words.max() < s.columns * s.rows * s.codes * s.among


def test_what_was_learnt_is_observed() -> None:
    words = dense()
    learnt = [words.learn(seen(texture(k))) for k in range(4)]
    assert words.size == len(np.unique(np.concatenate(learnt)))
    np.testing.assert_array_equal(learnt[0], np.arange(A_VIEW))  # ids are given in the order of meeting
    for k, ids in enumerate(learnt):
        np.testing.assert_array_equal(words.observe(seen(texture(k))).ids, ids)
        np.testing.assert_array_equal(words.learn(seen(texture(k))), ids)
        assert (np.diff(ids) > 0).all()


def test_observing_learns_nothing() -> None:
    words = dense()
    words.learn(seen(texture(0)))
    ids = words.observe(seen(texture(1))).ids
    known = np.intersect1d(dense().words_of(texture(0)), dense().words_of(texture(1)))
    assert len(ids) == len(known) > 0
    assert words.size == A_VIEW


def test_state_makes_the_same_words_again() -> None:
    words = dense()
    for k in range(3):
        words.learn(seen(texture(k)))
    again = make_extractor("dense/camera", BEST, words.state())
    assert (again.key, again.sensor, again.size) == ("dense/camera", "camera", words.size)
    np.testing.assert_array_equal(again.state()["words"], words.state()["words"])
    for k in range(5):
        np.testing.assert_array_equal(again.observe(seen(texture(k))).ids, words.observe(seen(texture(k))).ids)
