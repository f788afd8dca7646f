"""Answers of one stage: each view measured after the last answer, weighed, and tracked."""

from collections.abc import Sequence
from dataclasses import replace

from refseq.belief import Belief, Stage
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.measurer import Measurer
from refseq.map.tracking.odometer_scale import OdometerScale
from refseq.map.tracking.trackers import tracker_for
from refseq.map.tracking.usual import UsualViews


class StageAnswers:
    """The beliefs of one stage on the views that a measurer takes; ``measured`` is the last view as it was measured.

    Only the chain, which knows when it is lost, corrects the odometer's scale (``OdometerScale``) and weighs a view by
    what others of the drive brought (``UsualViews``), where the map's profile asks for that. Hindsight does the first
    and not the second: a stretch that looks like no place any more is one it finds by the views behind it.
    """

    def __init__(self, map_: Map, stage: Stage) -> None:
        self._stage, self._tracker = stage, tracker_for(stage, map_)
        chained, profile = stage is Stage.CHAIN, map_.profile
        self._scale = OdometerScale(map_) if chained and profile.motion.odometer_scale > 0 else None
        self._usual = UsualViews(map_) if chained and profile.log_ratio.usual > 0 else None
        self._last: Belief | None = None
        self.measured: Sequence[Measurement] = ()

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()
        if self._scale is not None:
            self._scale.reset()
        if self._usual is not None:
            self._usual.reset()
        self._last, self.measured = None, ()

    def update(self, measurer: Measurer) -> Belief:
        """The belief on the view that the measurer took last, with faults of sensors and the pose beside the place."""
        return self._kept(measurer.told(self._tracked(measurer)))

    def follow(self, measurer: Measurer) -> None:
        """Take the view as ``update`` does, for whoever asks for ``measured`` alone: no pose is fitted."""
        self._kept(self._tracked(measurer))

    def _tracked(self, measurer: Measurer) -> Belief:
        measured = measurer.after(self._last)
        self.measured = measured if self._scale is None else self._scale.corrected(measured)
        belief = self._tracker.update(self.measured if self._usual is None else self._usual.weighed(self.measured))
        if self._scale is None:
            return belief
        belief = replace(belief, odometer_scale=self._scale.scale)
        self._scale.told(measured, belief)
        return belief

    def _kept(self, belief: Belief) -> Belief:
        if self._usual is not None:
            self._usual.told(self.measured, belief)
        if self._stage is not Stage.UNIFORM:  # single views know of none before
            self._last = belief
        return belief
