import json
from dataclasses import replace

import numpy as np
import pytest

from refseq.errors import MapError
from refseq.inference.chain.chain import ChainSettings
from refseq.inference.matching.mixture import MixtureSettings
from refseq.map.extractors import FEATURES
from refseq.map.learning import learn
from refseq.map.profile import (
    BEST,
    COUNTING,
    LATER,
    NEURAL,
    PROFILES,
    THESIS,
    Decoder,
    Matching,
    Profile,
    profile_named,
    profile_of,
)
from refseq.view import Scan, View


def test_round_trip_through_json() -> None:
    profile = replace(Profile(), mixture=MixtureSettings(cost=0.9, iterations=7), chain=ChainSettings(window=3))
    assert Profile.from_dict(json.loads(json.dumps(profile.to_dict()))) == profile


def test_defaults_are_the_thesis_values_where_it_gives_them() -> None:
    profile = Profile()
    assert profile.chain.window == 5
    assert profile.chain.lost == 0.5
    assert 0.8 <= profile.mixture.cost <= 0.95
    assert 50 <= profile.sift.cap <= 200
    assert (profile.walls.points, profile.walls.length) == (6, 2.0)


MOTION_PARTS = "valid is a table of drift, interpolated, odometer_scale, regularisation, slack, stands_once, tail"


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        (
            "motion",
            None,
            f"profile.motion is None; {MOTION_PARTS}",
        ),
        ("motion", [1], f"profile.motion is [1]; {MOTION_PARTS}"),
        (
            "motion",
            {"slack": 1, "drift": 1, "tail": 1},
            "profile.motion.interpolated is missing; valid are drift, interpolated, odometer_scale, regularisation, "
            "slack, stands_once, tail",
        ),
        (
            "motion",
            {"slack": 1, "drift": True, "tail": 1, "interpolated": False, "regularisation": 1},
            "profile.motion.drift is True; valid is a number from 0 to 100",
        ),
        (
            "motion",
            {"slack": "1", "drift": 1, "tail": 1, "interpolated": False, "regularisation": 1},
            "profile.motion.slack is '1'; valid is a number from 0 to 10000",
        ),
    ],
)
def test_wrong_parts_are_named(part: str, value: object, message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        Profile.from_dict({**Profile().to_dict(), part: value})
    assert str(caught.value) == message


def test_an_unknown_parameter_is_refused() -> None:
    content = Profile().to_dict()
    content["chain"]["speed"] = 1.0
    with pytest.raises(ValueError, match=r"profile\.chain\.speed is unknown; valid are "):
        Profile.from_dict(content)


def test_maps_that_lack_later_settings_do_as_they_did() -> None:
    content = Profile().to_dict()
    for part, settings in LATER.items():
        for name in settings:
            del content[part][name]
    assert Profile.from_dict(content) == Profile()


@pytest.mark.parametrize("name", PROFILES)
def test_named_profiles_survive_json(name: str) -> None:
    profile = profile_named(name)
    again = Profile.from_dict(json.loads(json.dumps(profile.to_dict())))
    assert again == profile
    assert isinstance(again.method.matching, Matching)
    assert isinstance(again.method.decoding, Decoder)
    assert isinstance(again.features, tuple)
    assert set(profile.features) <= set(FEATURES)


def test_the_names_are_those_of_the_thesis_and_ours() -> None:
    assert dict(PROFILES) == {"thesis": THESIS, "counting": COUNTING, "best": BEST, "neural": NEURAL}
    assert Profile() == THESIS
    assert replace(COUNTING, mixture=THESIS.mixture) == THESIS, "nothing but EM is left out"
    assert (THESIS.method.matching, THESIS.method.decoding) == (Matching.MIXTURE, Decoder.VITERBI)
    assert (BEST.method.matching, BEST.method.decoding) == (Matching.LOG_RATIO, Decoder.FORWARD)
    with pytest.raises(TypeError):
        PROFILES["mine"] = BEST  # type: ignore[index]


@pytest.mark.parametrize("name", ["", "Best", "thesis "])
def test_another_name_is_refused(name: str) -> None:
    with pytest.raises(MapError) as caught:
        profile_named(name)
    assert str(caught.value) == f"profile {name!r} is unknown; valid are thesis, counting, best, neural"


@pytest.mark.parametrize("features", [None, "sift", ["sift", 3], {"sift": 1}])
def test_features_are_a_list_of_names(features: object) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        Profile.from_dict({**BEST.to_dict(), "features": features})
    assert str(caught.value) == f"profile.features is {features!r}; valid is a list of names"


@pytest.mark.parametrize("value", ["guess", "", None, 1, True, [], {"a": 1}])
def test_an_unknown_method_is_refused(value: object) -> None:
    for name, valid in (("matching", "mixture, log_ratio"), ("decoding", "viterbi, forward")):
        content = BEST.to_dict()
        content["method"][name] = value
        with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
            Profile.from_dict(content)
        assert str(caught.value) == f"profile.method.{name} is {value!r}; valid are {valid}"


@pytest.mark.parametrize("value", [1, 0, "true", None])
def test_yes_or_no_is_no_number(value: object) -> None:
    content = BEST.to_dict()
    content["sift"]["root"] = value
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        Profile.from_dict(content)
    assert str(caught.value) == f"profile.sift.root is {value!r}; valid is true or false"


@pytest.mark.parametrize(
    ("part", "key", "value", "message"),
    [
        ("dense", "columns", 8.5, "profile.dense.columns is 8.5; valid is a whole number from 1 to 256"),
        ("dense", "codes", True, "profile.dense.codes is True; valid is a whole number from 1 to 64"),
        ("log_ratio", "blind", float("nan"), "profile.log_ratio.blind is nan; valid is a number from 0 to 1"),
        (
            "chain",
            "relocalisation_range",
            float("inf"),
            "profile.chain.relocalisation_range is inf; valid is a number from 0.001 to 1000",
        ),
        ("sift", "root", 1, "profile.sift.root is 1; valid is true or false"),
    ],
)
def test_values_of_the_wrong_kind_are_named(part: str, key: str, value: object, message: str) -> None:
    content = BEST.to_dict()
    content[part][key] = value
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        Profile.from_dict(content)
    assert str(caught.value) == message


def test_a_name_may_change_settings() -> None:
    changed = profile_named("thesis+chain.window=20+mixture.cost=0.9+sift.root=true+method.decoding=forward")
    assert (changed.chain.window, changed.mixture.cost, changed.sift.root) == (20, 0.9, True)
    assert changed.method.decoding is Decoder.FORWARD
    plain = replace(changed, chain=THESIS.chain, mixture=THESIS.mixture, sift=THESIS.sift, method=THESIS.method)
    assert plain == THESIS, "nothing else is another"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ("chain.window", "setting 'chain.window' is unknown; valid is PART.SETTING=VALUE with a part of method, "),
        ("features=sift", "setting 'features=sift' is unknown; valid is PART.SETTING=VALUE with a part of method, "),
        (
            "motion.speed=1",
            "setting 'motion.speed' is unknown; valid is PART.SETTING=VALUE, of motion one of drift, interpolated, ",
        ),
        ("chain.window=0", "profile.chain.window is 0; valid is a whole number from 1 to 10000"),
        ("chain.window=5+chain.lost=0.4+chain.window=6", "setting 'chain.window' is given twice; valid is once"),
        ("chain.noise=2", "profile.chain.noise is 2; valid is a number from 1e-12 to 1"),
        ("chain.lost_view_at_place=0", "profile.chain.lost_view_at_place is 0; valid is a number from 1e-06 to 0.999"),
        ("+", "setting '' is unknown; valid is PART.SETTING=VALUE with a part of method, "),
        ("chain=3", "setting 'chain' is unknown; valid is PART.SETTING=VALUE, of chain one of carried, exit_at_ends, "),
        ("chain.window=NaN", "profile.chain.window is nan; valid is a whole number from 1 to 10000"),
        ("chain.window=" + "9" * 5000, "profile.chain.window is '999"),
        ("chain.noise=" + "[" * 99999, "profile.chain.noise is '[[["),
        ("method.decoding=guess", "profile.method.decoding is 'guess'; valid are viterbi, forward"),
        ("mixture.limit=0.5", "mixture.limit is 0.5; valid is at least 0.0 and less than 0.5"),
    ],
)
def test_a_wrong_change_is_one_line_that_names_it(changes: str, message: str) -> None:
    with pytest.raises(MapError) as caught:
        profile_named(f"thesis+{changes}")
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("own", "message"),
    [
        (
            replace(THESIS, chain=replace(THESIS.chain, window=0)),
            "profile.chain.window is 0; valid is a whole number from 1 to 10000",
        ),
        (
            replace(BEST, chain=replace(BEST.chain, stay_lost=1.5)),
            "profile.chain.stay_lost is 1.5; valid is a number from 0 to 1",
        ),
        (replace(BEST, features="walls"), "profile.features is 'walls'; valid is a list of names"),  # type: ignore[arg-type]
    ],
)
def test_a_profile_of_one_s_own_is_held_to_what_a_file_is(own: Profile, message: str) -> None:
    with pytest.raises(MapError) as caught:
        profile_of(own)
    assert str(caught.value) == message
    with pytest.raises(MapError, match=r"^profile\."):
        learn([View(float(k), scan=Scan(np.full(361, 3.0, np.float32)), distance=1.0) for k in range(3)], profile=own)


@pytest.mark.parametrize("name", PROFILES)
def test_the_named_profiles_are_valid_as_they_are(name: str) -> None:
    assert profile_of(PROFILES[name]) == PROFILES[name]


def test_numbers_of_numpy_become_plain_ones() -> None:
    chain = replace(BEST.chain, window=np.int64(7), stay_lost=np.float32(0.5))
    own = profile_of(replace(BEST, chain=chain))
    assert own == replace(BEST, chain=replace(BEST.chain, window=7, stay_lost=0.5))
    assert json.loads(json.dumps(own.to_dict())) == own.to_dict()
