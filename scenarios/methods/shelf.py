"""Maps of our own localiser by the name of a profile: learnt, or taken from where they are kept."""

from collections.abc import Callable, Sequence

from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.view import View

Shelf = Callable[[str, Sequence[View]], Map]
"""Gives the map of some views with a profile, by its name: one that is kept, or one that is learnt now."""


def learn_map(profile: str, views: Sequence[View]) -> Map:
    """Learn the map of some views with a profile: a shelf on which nothing is kept."""
    return learn(views, profile=profile)
