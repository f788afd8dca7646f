"""Neural networks by which methods of ours find keys: files of the user's, which change what is answered."""

from collections.abc import Iterable, Mapping, Sequence

from refseq.map.profile import profile_named
from refseq_bench.scenarios.methods.by_name import profile_of


def network_digest(profile: str, features: Sequence[str] | None = None) -> str | None:
    """SHA-256 of the network that a profile finds keys by, None where ``features``, by default its own, ask none.

    Raises ``MapError`` without it.
    """
    return profile_named(profile).with_network(features).neural.network or None


def networks_of(methods: Iterable[str], features: Sequence[str] | None = None) -> Mapping[str, str]:
    """Digests of the networks that some methods ask, by their profiles. Raises ``MapError`` where one is missing."""
    profiles = filter(None, map(profile_of, methods))
    return {profile: digest for profile in profiles if (digest := network_digest(profile, features))}
