"""Maps of our own localiser by the name of a profile: learnt, or taken from where they are kept."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from refseq.map.compact import compact
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.reduction import share_of_words, with_most_informative
from refseq.view import View

Shelf = Callable[[str, Sequence[View]], Map]
"""Gives the map of some views with a profile, by its name: one that is kept, or one that is learnt now."""


@dataclass(frozen=True, slots=True)
class Learning:
    """Making of our own localiser's map of a drive.

    ``features`` are names of ``refseq.map.extractors.FEATURES``, None: the profile's. Of what was learnt only a share
    of the ``words`` is kept, those that tell most about the place (2.6), and neighbouring places that are at most
    ``alike`` apart show the same (6.4.5); None: none of them.
    """

    features: tuple[str, ...] | None = None
    words: float = 1.0
    alike: float | None = None

    def learnt(self, profile: str, views: Sequence[View]) -> Map:
        """Learn the whole map of some views."""
        return learn(views, profile=profile, features=self.features)

    def smaller(self, map_: Map) -> Map:
        """The part that is kept of a map that was learnt."""
        if self.words < 1:
            kept = (with_most_informative(one, share_of_words(one, self.words)) for one in map_.sequences)
            map_ = replace(map_, sequences=tuple(kept))
        return map_ if self.alike is None else compact(map_, self.alike).map


WHOLE = Learning()
"""All that the profile learns; ``WHOLE.learnt`` is a shelf on which nothing is kept."""
