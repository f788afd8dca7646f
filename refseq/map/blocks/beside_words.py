"""Everything that is asked of a few places beside their words, for each way of localising."""

from collections.abc import Collection, Sequence

from refseq.belief import Belief
from refseq.map.blocks.few_places import FewPlaces
from refseq.map.blocks.key_block import KeyBlock
from refseq.map.blocks.scan_block import ScanBlock
from refseq.map.guard import SensorGuard
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.poses_beside import PosesBeside


class BesideWords:
    """Scan and keys of a view laid on those of places: take each view, weigh its measurements, add its pose.

    ``sensors`` are those of the map that are asked.
    """

    def __init__(self, map_: Map, sensors: Collection[str]) -> None:
        self._poses, self._keys = PosesBeside(map_), KeyBlock(map_)
        self._few = FewPlaces(map_, [ScanBlock(map_, self._poses, sensors), self._keys])

    def take(self, guard: SensorGuard) -> None:
        """Take what can be trusted of the view that the guard looked at last."""
        self._poses.take(guard.scan)
        self._keys.take(guard.keys() if self._keys.most else {})

    def weighed(self, measured: Sequence[Measurement], last: Belief | None) -> list[Measurement]:
        """Measurements with the evidence of scan and keys; ``last`` is the belief before, where it is a prior."""
        return self._few.weighed(measured, last)

    def with_pose(self, belief: Belief) -> Belief:
        """The belief with its pose, where there is one."""
        return self._poses.with_pose(belief)
