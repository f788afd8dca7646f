"""Maps of our own localiser by the name of a profile: learnt, or taken from where they are kept."""

from collections.abc import Callable, Sequence

from refseq.map.profile import profile_named
from refseq.map.sequence import ReferenceSequence, learn
from refseq.view import View

Shelf = Callable[[str, Sequence[View]], ReferenceSequence]
"""Gives the map of some views with a profile, by its name: one that is kept, or one that is learnt now."""


def learn_map(profile: str, views: Sequence[View]) -> ReferenceSequence:
    """Learn the map of some views with a profile: a shelf on which nothing is kept."""
    return learn(views, profile=profile_named(profile))
