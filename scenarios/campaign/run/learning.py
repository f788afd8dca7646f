"""Learn maps of reference drives, each once: they are kept in the store for all that learn the same views."""

from collections.abc import Callable, Sequence
from pathlib import Path

from refseq.errors import RefseqError
from refseq.features.memory import clock
from refseq.logs import Recording
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.campaign.store.cache import MAP, Store
from refseq_bench.scenarios.drives.selection import only, stretch
from refseq_bench.scenarios.methods.shelf import Learning, Shelf

LEARNING = "learning_s"
"""In a kept map's metadata: how long learning it took [s]."""


def selected(recording: Recording, places: str | None, sensors: tuple[str, ...] | None) -> Recording:
    """The views ``places`` FROM:TO of a recording, with some ``sensors``; None: all."""
    views = recording.views[stretch(places, len(recording.views), Path("localise.places"))]
    return Recording(tuple(only(view, sensors) for view in views), recording.metadata)


def kept_maps(store: Store, learning: Learning, key_for: Callable[[str], str]) -> Shelf:
    """Maps of some views in the store, by the keys for their profiles; learnt where they are not there or damaged.

    Whole ones are kept, however small they are made then: that takes no time beside learning them.
    """

    def shelf(profile: str, views: Sequence[View]) -> Map:
        def make(path: Path) -> None:
            begin = clock()
            map_ = learning.learnt(profile, views)
            map_.noted({LEARNING: f"{clock() - begin:.3f}"}).save(path)

        key = key_for(profile)
        kept = store.make(key, MAP, make)
        try:
            whole = Map.load(kept)
        except RefseqError:
            store.discard(key)
            whole = Map.load(store.make(key, MAP, make))
        return learning.smaller(whole)

    return shelf
