"""The neural network by which methods find keys: a file of the user's, which changes what is answered."""

from collections.abc import Collection, Sequence

from refseq.map.learning import with_network
from refseq.map.profile import profile_named
from refseq.view import LASER
from refseq_bench.scenarios.methods.names import profile_of

OF_BASELINES = "thesis"
"""Profile with which baselines learn maps."""


def network_of(
    methods: Sequence[str], features: Sequence[str] | None = None, sensors: Collection[str] | None = None
) -> str | None:
    """SHA-256 of the network that some methods ask who look at some ``sensors`` (None: all); None: they ask none.

    Raises ``MapError`` where it is missing.
    """
    profiles = [profile_named(profile_of(method) or OF_BASELINES) for method in methods]
    asking = [profile for profile in profiles if profile.asks_network(features)]
    if not asking or (sensors is not None and set(sensors) == {LASER}):
        return None
    return with_network(asking[0], features).neural.network
