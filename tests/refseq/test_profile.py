import json
from dataclasses import replace

import pytest

from refseq.chain import ChainSettings
from refseq.mixture import MixtureSettings
from refseq.profile import Profile


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


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("motion", None, "profile.motion is None; valid is a table of drift, regularisation, slack, thin"),
        ("motion", [1], "profile.motion is [1]; valid is a table of drift, regularisation, slack, thin"),
        (
            "motion",
            {"slack": 1, "drift": 1, "thin": 1},
            "profile.motion is {'slack': 1, 'drift': 1, 'thin': 1}; "
            "valid is a table of drift, regularisation, slack, thin",
        ),
        (
            "motion",
            {"slack": 1, "drift": True, "thin": 1, "regularisation": 1},
            "profile.motion.drift is True; valid is a number",
        ),
        (
            "motion",
            {"slack": "1", "drift": 1, "thin": 1, "regularisation": 1},
            "profile.motion.slack is '1'; valid is a number",
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
    with pytest.raises(ValueError, match=r"profile\.chain is .*; valid is a table of "):
        Profile.from_dict(content)
