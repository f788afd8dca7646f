"""Names beside what they stand for: both tell the same."""

from refseq.map.extractors import FEATURES
from refseq.map.names import ASKING_NETWORK, FEATURE_NAMES, PROFILE_NAMES
from refseq.map.profile import PROFILES


def test_each_feature_and_profile_has_its_name() -> None:
    assert tuple(FEATURES) == FEATURE_NAMES
    assert tuple(PROFILES) == PROFILE_NAMES


def test_profiles_that_ask_a_network_are_told_as_such() -> None:
    assert tuple(name for name, profile in PROFILES.items() if profile.asks_network()) == ASKING_NETWORK
