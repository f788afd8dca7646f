import cv2
import numpy as np
import pytest

from refseq.features.sift import SiftSettings, SiftWords, root
from refseq.view import View


def texture(seed: int = 0, height: int = 160, width: int = 213) -> np.ndarray:
    """Blobs of several sizes."""
    rng = np.random.default_rng(seed)
    layers = [cv2.resize(rng.random((n, n)), (width, height), interpolation=cv2.INTER_CUBIC) for n in (8, 20, 45)]
    return np.clip(sum(layers) / 3 * 255, 0, 255).astype(np.uint8)


def sift(**settings: float) -> SiftWords:
    return SiftWords("camera", SiftSettings(**settings))


def seen(image: np.ndarray) -> View:
    return View(0.0, {"camera": image})


@pytest.mark.parametrize("value", [0, 128, 255])
def test_a_blank_image_gives_nothing(value: int) -> None:
    blank = np.full((120, 160), value, np.uint8)
    words = sift()
    assert words.keys(blank).descriptors.shape == (0, 128)
    assert len(words.learn(seen(blank))) == 0
    assert len(words.observe(seen(blank)).ids) == 0
    assert words.size == 0


def test_the_cap_keeps_the_strongest() -> None:
    image = texture()
    keys, descriptors = cv2.SIFT.create(contrastThreshold=SiftSettings().contrast).detectAndCompute(image, None)
    used = [i for i, key in enumerate(keys) if key.octave & 0xFF in (0, 1)]
    strongest = sorted(used, key=lambda i: -keys[i].response)[:40]
    assert len(used) > 80
    np.testing.assert_array_equal(sift(cap=40).keys(image).descriptors, descriptors[strongest].astype(np.uint8))


def test_only_the_full_and_the_half_resolution_are_used() -> None:
    """OpenCV doubles the image first; its keys there (octave −1) and below the half resolution are left out."""
    image = texture()
    keys, descriptors = cv2.SIFT.create(contrastThreshold=SiftSettings().contrast).detectAndCompute(image, None)
    octaves = np.array([key.octave & 0xFF for key in keys], np.uint8).view(np.int8)
    assert {-1, 0, 1, 2} <= set(octaves.tolist())  # or this test would show nothing
    expected = descriptors[(octaves == 0) | (octaves == 1)].astype(np.uint8)
    ours = sift(cap=10_000).keys(image).descriptors
    assert sorted(map(bytes, ours)) == sorted(map(bytes, expected))


def test_octaves_are_parameters() -> None:
    image = texture()
    keys, descriptors = cv2.SIFT.create(contrastThreshold=SiftSettings().contrast).detectAndCompute(image, None)
    octaves = np.array([key.octave & 0xFF for key in keys], np.uint8).view(np.int8)
    for first, last in ((-1, 0), (1, 2), (2, 1)):
        expected = descriptors[(first <= octaves) & (octaves <= last)].astype(np.uint8)
        ours = sift(cap=10_000, first_octave=first, last_octave=last).keys(image).descriptors
        assert sorted(map(bytes, ours)) == sorted(map(bytes, expected))


def test_the_halved_image_gives_the_half_resolution_and_most_of_the_full_one() -> None:
    """Without the doubled image, keys and descriptors are near those with it."""
    image = texture(4, 320, 426)
    for octave, share in ((0, 0.5), (1, 0.5)):
        limits = {"first_octave": octave, "last_octave": octave, "cap": 10_000}
        ours, expected = (sift(halved=half, **limits).keys(image).descriptors.astype(float) for half in (True, False))
        assert 0.7 * len(expected) < len(ours) < 1.4 * len(expected)
        nearest = np.sqrt(((expected[:, None] - ours[None]) ** 2).sum(axis=2).min(axis=1))
        assert np.mean(nearest < 100) > share


@pytest.mark.parametrize("halved", [False, True])
def test_a_blob_has_a_key_in_its_middle(halved: bool) -> None:
    rows, columns = np.mgrid[:240, :320]
    spot = 40 + 180 * np.exp(-((rows - 100.5) ** 2 + (columns - 150.5) ** 2) / (2 * 6.0**2))
    found = sift(halved=halved, last_octave=3).keys(spot.astype(np.uint8))
    assert len(found.points) == len(found.descriptors) > 0
    # OpenCV's doubled image is a quarter of a pixel off, and so are all keys.
    assert np.abs(found.points - (150.5, 100.5)).max(axis=1).min() < 0.3 * (1 + halved)


def test_the_root_makes_the_scalar_product_hellingers() -> None:
    descriptors = sift().keys(texture()).descriptors
    rooted = root(descriptors)
    assert rooted.dtype == np.uint8
    shares = descriptors / descriptors.sum(axis=1, keepdims=True)
    expected = np.sqrt(shares) @ np.sqrt(shares).T
    np.testing.assert_allclose(rooted.astype(float) @ rooted.T.astype(float) / 512**2, expected, atol=0.01)
    np.testing.assert_array_equal(sift(root=True).keys(texture()).descriptors, rooted)


def test_the_root_of_an_empty_descriptor_is_empty() -> None:
    np.testing.assert_array_equal(root(np.zeros((2, 128), np.uint8)), np.zeros((2, 128)))
    assert root(np.zeros((0, 128), np.uint8)).shape == (0, 128)
    single = np.zeros((1, 128), np.uint8)
    single[0, 5] = 200
    assert root(single)[0, 5] == 255


def test_a_large_vocabulary_is_matched_by_its_index() -> None:
    exact, large = sift(), sift(exact_up_to=10)
    for seed in range(6):
        np.testing.assert_array_equal(large.learn(seen(texture(seed))), exact.learn(seen(texture(seed))))
    assert large.size > 400
    view = seen(texture(3)[2:, 3:].copy())
    found, expected = large.observe(view).ids, exact.observe(view).ids
    assert len(np.intersect1d(found, expected)) > 0.9 * len(expected)


def test_the_same_image_gives_the_same_words() -> None:
    image = texture(3)
    first, second = sift(), sift()
    np.testing.assert_array_equal(first.learn(seen(image)), second.learn(seen(image)))
    np.testing.assert_array_equal(first.vocabulary.words, second.vocabulary.words)
    np.testing.assert_array_equal(first.observe(seen(image)).ids, first.learn(seen(image)))


def test_words_survive_a_small_shift_and_less_light_and_differ_between_scenes() -> None:
    words = sift()
    learnt = words.learn(seen(texture(1)))
    moved = cv2.warpAffine(texture(1), np.array([[1.0, 0, 4], [0, 1, 3]]), (213, 160), borderMode=cv2.BORDER_REFLECT)
    darker = (moved * 0.7).astype(np.uint8)
    again = np.intersect1d(learnt, words.observe(seen(moved)).ids)
    dark = np.intersect1d(learnt, words.observe(seen(darker)).ids)
    other = np.intersect1d(learnt, words.observe(seen(texture(2))).ids)
    assert len(learnt) > 50
    assert len(again) > 0.7 * len(learnt)
    assert len(dark) > 0.5 * len(learnt)
    assert len(other) < 0.3 * len(learnt)


def test_state_makes_the_same_extractor_again() -> None:
    words = sift()
    words.learn(seen(texture(1)))
    again = SiftWords("camera", words.settings, words.state()["words"])
    assert (again.key, again.sensor, again.size) == ("sift/camera", "camera", words.size)
    view = seen(texture(1)[2:, 3:].copy())
    np.testing.assert_array_equal(again.observe(view).ids, words.observe(view).ids)


def test_known_descriptors_of_a_sample_are_counted_alike_whether_the_view_was_recognised_or_not() -> None:
    """Also where words have come since: what was recognised before them is not believed."""
    words, rng = sift(), np.random.default_rng(5)
    words.learn(seen(texture(1)))
    for number in (2, 1, 3):
        described = words.describe(seen(texture(number)[2:, 3:].copy()))
        sample = rng.choice(len(described), 30, replace=False)
        count = words.count_known(described, sample)
        assert count == len(words.vocabulary.match(described[sample]))
        words.recognise(described)
        assert words.count_known(described, sample) == count
        assert words.count_known(described, sample[:9]) == len(words.vocabulary.match(described[sample[:9]]))
        words.learn(seen(texture(number)[2:, 3:].copy()))
        assert words.count_known(described, sample) == len(words.vocabulary.match(described[sample])) > count


def test_keys_are_found_once_in_a_picture_that_somebody_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    words, looked_at = sift(), list[int]()
    find = words.find_keys
    monkeypatch.setattr(words, "find_keys", lambda image: looked_at.append(id(image)) or find(image))
    pictures = [texture(seed) for seed in range(3)]
    found = [words.keys(picture) for picture in pictures]
    assert all(words.drawn(picture) is keys for picture, keys in zip(pictures, found, strict=True))
    assert len(looked_at) == 3
    assert len(words.drawn(pictures[0].copy()).points) == len(found[0].points)
    assert len(looked_at) == 4


def test_no_keys_are_kept_of_pictures_that_nobody_holds() -> None:
    words = sift()
    for seed in range(3):
        words.keys(texture(seed))
    assert not words._found
