"""Measuring a view, for every way of localising: its words, under guard, then scan and keys at a few places."""

from collections.abc import Sequence

from refseq.belief import Belief
from refseq.map.blocks.beside_words import BesideWords
from refseq.map.guard import SensorGuard, ViewFaults
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.view import View


class Measurer:
    """Views to measurements: take each view, ask how it is weighed after a belief, complete the belief that follows.

    One view can be asked after several beliefs, as stages have their own. Takes the same as ``SensorGuard``, and raises
    the same.
    """

    def __init__(self, map_: Map, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        self._guard = SensorGuard(map_, sensors=sensors, seed=seed)
        self._beside = BesideWords(map_, self._guard.sensors)
        self._words: list[Measurement] = []

    def reset(self) -> None:
        """Forget all views seen."""
        self._guard.reset()
        self._words = []

    def take(self, view: View) -> None:
        """Take the next view."""
        self._words = self._guard.match(view)
        self._beside.take(self._guard)

    def after(self, last: Belief | None) -> list[Measurement]:
        """The view in every sequence; ``last`` is the belief before it, None where that does not count."""
        return self._beside.weighed(self._words, last)

    def completed(self, belief: Belief) -> Belief:
        """The view's belief with faults of sensors and the pose beside the place, where there are any."""
        return self._beside.with_pose(self.view_faults.added_to(belief))

    @property
    def view_faults(self) -> ViewFaults:
        """Faults of sensors that stand at the view taken last."""
        return self._guard.view_faults
