"""Answers of one stage: each view measured after the last answer, weighed, and tracked."""

from collections.abc import Sequence
from dataclasses import replace

from refseq.belief import Belief, Stage
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.measurer import Measurer
from refseq.map.tracking.last_fixes import LastFixes, can_trust_fixes
from refseq.map.tracking.odometer_scale import OdometerScale
from refseq.map.tracking.trackers import tracker_for
from refseq.map.tracking.usual import UsualViews


class StageAnswers:
    """The beliefs of one stage on the views that a measurer takes; ``measured`` is the last view as it was measured.

    ``sensors`` are those of the map that are asked, all by default. Only the chain, which knows when it is lost,
    corrects the odometer's scale (``OdometerScale``) and weighs a view by what others of the drive brought
    (``UsualViews``) and by the way since those that it was sure of (``LastFixes``), where the map's profile asks for
    that. Hindsight does the first alone, and does not ask whether the robot was carried: a stretch that looks like no
    place any more is one it finds by the views behind it.
    """

    def __init__(self, map_: Map, stage: Stage, *, sensors: Sequence[str] | None = None) -> None:
        self._stage, self._tracker = stage, tracker_for(stage, map_)
        chained, profile = stage is Stage.CHAIN, map_.profile
        self._scale = OdometerScale(map_) if chained and profile.motion.odometer_scale > 0 else None
        asked = profile.log_ratio if chained and profile.by_log_ratios else None
        self._weighers: list[UsualViews | LastFixes] = []
        if asked and asked.usual > 0:
            self._weighers.append(UsualViews(map_))
        if asked and asked.fixes > 0 and can_trust_fixes(map_, sensors):
            self._weighers.append(LastFixes(map_))
        self._last: Belief | None = None
        self.measured: Sequence[Measurement] = ()

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()
        if self._scale is not None:
            self._scale.reset()
        for one in self._weighers:
            one.reset()
        self._last, self.measured = None, ()

    def update(self, measurer: Measurer) -> Belief:
        """The belief on the view that the measurer took last, with faults of sensors and the pose beside the place."""
        return self._kept(measurer.completed(self._tracked(measurer)))

    def follow(self, measurer: Measurer) -> None:
        """Take the view as ``update`` does, for whoever asks for ``measured`` alone: no pose is fitted."""
        self._kept(self._tracked(measurer))

    def _tracked(self, measurer: Measurer) -> Belief:
        measured = measurer.after(self._last)
        self.measured = measured if self._scale is None else self._scale.corrected(measured)
        weighed = self.measured
        for one in self._weighers:
            weighed = one.weighed(weighed)
        belief = self._tracker.update(weighed)
        if self._scale is None:
            return belief
        belief = replace(belief, odometer_scale=self._scale.scale)
        self._scale.remember(measured, belief)
        return belief

    def _kept(self, belief: Belief) -> Belief:
        for one in self._weighers:
            one.remember(self.measured, belief)
        if self._stage is not Stage.UNIFORM:  # single views know of none before
            self._last = belief
        return belief
