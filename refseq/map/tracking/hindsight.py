"""Hindsight: where each view of a whole drive was taken, in the light of all its views."""

from collections.abc import Sequence
from dataclasses import replace

from refseq.belief import Belief
from refseq.inference.chain.chain import Observation
from refseq.inference.chain.forward import StatePosterior
from refseq.inference.chain.path_filter import path_smoothed
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.tracking.stages import ChainTracker
from refseq.map.tracking.stands import Stands
from refseq.map.tracking.trackers import NetworkTracker


class Hindsight:
    """Gathers the measurements of a drive, view by view, and answers when all are there.

    The chain is that of the map's profile, summed over all paths (``path_smoothed``) whatever its decoding. Raises
    ``MapError`` for a map of several paths whose matching is the mixture, which knows no scale common to them.
    """

    def __init__(self, map_: Map) -> None:
        self._tracker = NetworkTracker(map_) if map_.profile.by_log_ratios else _OnePath(map_)
        self._stands = Stands()
        self._counted: list[Sequence[Measurement]] = []

    def take(self, measured: Sequence[Measurement]) -> None:
        """Take the next view, as it was measured in every sequence."""
        # A whole drive's blocks would fill the memory; and a stretch that changed is none that it was carried past.
        bare = [replace(one, by_block={}, log_ratio_carried=0.0) for one in measured]
        self._counted.append(self._stands.mean(bare))

    def beliefs(self) -> list[Belief]:
        """The answers to all views taken, each in the light of all."""
        tracker = self._tracker
        tracker.reset()
        posteriors = path_smoothed([tracker.observation(one) for one in self._counted], tracker.space)
        return [tracker.belief(*pair) for pair in zip(posteriors, self._counted, strict=True)]


class _OnePath:
    """The chain of a map of one path, asked as that of a network is."""

    def __init__(self, map_: Map) -> None:
        self._tracker = ChainTracker(map_.sequence)
        self.space = self._tracker.chain

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()

    def observation(self, measured: Sequence[Measurement]) -> Observation:
        """A measurement as the chain sees it."""
        return self._tracker.observation(measured[0])

    def belief(self, posterior: StatePosterior, measured: Sequence[Measurement]) -> Belief:
        """The posterior as a belief."""
        return self._tracker.belief(posterior, measured[0].timings)
