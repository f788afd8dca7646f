"""Neural networks by which methods of ours find keys: files of the user's, which change what is answered."""

from collections.abc import Iterable, Mapping

from refseq.map.profile import profile_named
from refseq_bench.scenarios.methods.by_name import profile_of


def network_digest(profile: str) -> str | None:
    """SHA-256 of the network that a profile finds keys by, None where it asks none. Raises ``MapError`` without it."""
    return profile_named(profile).with_network().neural.network or None


def networks_of(methods: Iterable[str]) -> Mapping[str, str]:
    """Digests of the networks that some methods ask, by their profiles. Raises ``MapError`` where one is missing."""
    profiles = filter(None, map(profile_of, methods))
    return {profile: digest for profile in profiles if (digest := network_digest(profile))}
