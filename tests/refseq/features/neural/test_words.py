from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.errors import MapError, ViewError
from refseq.features.neural.network import FILE
from refseq.features.neural.words import NeuralSettings, NeuralWords, pinned
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise
from refseq.map.map import Map
from refseq.map.profile import BEST, PROFILES, Profile, profile_named
from refseq.view import View
from tests.key_network import write_key_network
from tests.support import corridor_drive

SMALL = NeuralSettings(width=160, height=120, cap=60)
DOTS = replace(SMALL, floor=0.6)
"""Above what the network finds at the borders, outside of which it takes pictures for black."""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's network, for pictures as ``SMALL`` has them."""
    monkeypatch.setenv(FILE, str(tmp_path / "keys.onnx"))
    return write_key_network(tmp_path / "keys.onnx", SMALL.width, SMALL.height)


@pytest.fixture
def profile(file: Path) -> Profile:
    return replace(PROFILES["neural"], neural=SMALL)


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(3), count=12)


def seen(image: np.ndarray) -> View:
    return View(0.0, {"camera": image})


def dots(*at: tuple[int, int], shape: tuple[int, int] = (120, 160)) -> np.ndarray:
    image = np.full(shape, 60, np.uint8)
    for x, y in at:
        image[y, x] = 250
    return image


def test_keys_are_where_the_score_has_its_peaks(file: Path) -> None:
    points = NeuralWords("camera", DOTS).keys(dots((40, 30), (100, 80))).points
    assert sorted(map(tuple, points.tolist())) == [(40, 30), (100, 80)]


def test_points_are_those_of_the_picture_whatever_its_size(file: Path) -> None:
    """Twice as large a picture, each of its pixels made four: keys lie between the four."""
    large = np.kron(dots((40, 30), (100, 80)), np.ones((2, 2), np.uint8))
    points = NeuralWords("camera", DOTS).keys(large).points
    assert sorted(map(tuple, points.tolist())) == [(80.5, 60.5), (200.5, 160.5)]


def test_the_cap_keeps_the_strongest_and_the_floor_leaves_out_the_weakest(file: Path) -> None:
    image = dots((40, 30))
    image[80, 100] = 120
    both = NeuralWords("camera", DOTS).keys(image).points
    assert both[0].tolist() == [40, 30]
    assert len(both) == 2
    for settings in (replace(DOTS, cap=1), replace(DOTS, floor=1.5)):
        np.testing.assert_array_equal(NeuralWords("camera", settings).keys(image).points, both[:1])


def test_a_picture_shows_the_words_that_it_taught(file: Path, drive: list[View]) -> None:
    words = NeuralWords("camera", replace(SMALL, alias_distance=0.2))
    image = next(iter(drive[0].images.values()))
    taught = words.learn(seen(image))
    assert len(taught) > 10
    np.testing.assert_array_equal(words.observe(seen(image)).ids, taught)
    assert len(words.observe(seen(cv2.flip(image, -1))).ids) < len(taught) / 2


def test_a_blank_picture_shows_none(file: Path) -> None:
    words = NeuralWords("camera", DOTS)
    assert len(words.learn(seen(np.full((120, 160), 60, np.uint8)))) == 0
    assert len(words.observe(seen(np.full((120, 160), 60, np.uint8))).ids) == 0


def test_a_map_carries_the_network_and_answers_the_same_from_its_file(
    profile: Profile, drive: list[View], tmp_path: Path
) -> None:
    learnt = learn(drive, profile=profile)
    assert learnt.profile.neural == pinned(SMALL)
    learnt.save(tmp_path / "map.refseq")
    again = Map.load(tmp_path / "map.refseq")
    for view in drive:
        one, other = (Localiser(map_).update(view) for map_ in (learnt, again))
        np.testing.assert_array_equal(one.places, other.places)


def test_a_map_is_read_without_the_network_and_asked_only_with_its_own(
    profile: Profile, file: Path, drive: list[View], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learn(drive, profile=profile).save(tmp_path / "map.refseq")
    write_key_network(tmp_path / "other.onnx", SMALL.width, SMALL.height, seed=2)
    for name, reason in (("", "names no neural network"), (str(tmp_path / "other.onnx"), "valid is an ONNX file of")):
        monkeypatch.setenv(FILE, name)
        map_ = Map.load(tmp_path / "map.refseq")
        assert len(map_) == len(drive)
        with pytest.raises(MapError, match=reason):
            Localiser(map_)
        Localiser(map_, sensors=["laser"]).update(drive[0])


def test_a_localiser_goes_on_when_the_file_is_gone(profile: Profile, file: Path, drive: list[View]) -> None:
    localiser = Localiser(learn(drive, profile=profile))
    file.unlink()
    assert localiser.update(drive[3]).best == 3


def test_words_that_no_network_can_have_described_are_refused(file: Path) -> None:
    words = NeuralWords("camera", SMALL, np.zeros((5, 7), np.uint8))
    with pytest.raises(MapError, match="neural/camera: words have 7 values; valid are the 16 of its network"):
        words.prepare()


def test_a_network_that_fails_at_a_picture_is_told(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = NeuralWords("camera", SMALL)
    words.prepare()
    monkeypatch.setattr(np, "isfinite", lambda array: np.zeros(array.shape, bool))
    with pytest.raises(MapError, match="neural/camera: its network answers with numbers that are not finite"):
        words.keys(dots((40, 30)))


def test_a_floor_that_no_key_reaches_is_refused(profile: Profile, drive: list[View]) -> None:
    with pytest.raises(
        ViewError, match=r"no picture of 12 views has a key of score 50; valid is a lower neural\.floor"
    ):
        learn(drive, profile=replace(profile, neural=replace(SMALL, floor=50.0)))


def test_geometry_lays_keys_of_sift_and_without_any_there_is_none(profile: Profile, drive: list[View]) -> None:
    asked, none = (replace(profile, log_ratio=replace(profile.log_ratio, geometry=most)) for most in (8, 0))
    alone = [learn(drive, profile=one) for one in (asked, none)]
    assert not alone[0].keys(3)
    assert learn(drive, profile=asked, features=("sift", "neural")).keys(3)
    assert localise(alone[0], drive[:6]) == localise(alone[1], drive[:6])


def test_a_laser_alone_asks_no_network(drive: list[View], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FILE, raising=False)
    assert learn(drive, profile="neural", sensors=["laser"]).profile.neural.network == ""


def test_any_profile_may_ask_it_beside_its_other_features(profile: Profile, drive: list[View]) -> None:
    asked = replace(BEST, neural=SMALL)
    learnt = learn(drive, profile=asked, features=("sift", "neural"))
    assert {key.partition("/")[0] for key in learnt.sequences[0].matrix.blocks} == {"sift", "neural"}
    assert learnt.profile.neural.network == pinned(SMALL).network


@pytest.mark.parametrize("digest", ["0123", "g" * 64, 3, None, "A" * 64])
def test_a_digest_that_is_none_is_refused(digest: object) -> None:
    content = BEST.to_dict()
    content["neural"]["network"] = digest
    with pytest.raises(ValueError, match=r"profile\.neural\.network is .*; valid are the 64 hexadecimal digits"):
        Profile.from_dict(content)


def test_maps_from_before_there_were_any_are_read() -> None:
    content = BEST.to_dict()
    del content["neural"]
    assert Profile.from_dict(content) == BEST
    assert profile_named("neural+neural.cap=200").neural.cap == 200
