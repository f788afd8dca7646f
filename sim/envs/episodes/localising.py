"""Localisation while an environment runs: a drive to learn the path, then a localiser that follows the robot.

The laser is enough for it: what is learnt and asked are scans.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.planar import Pose, motion_between
from refseq.view import LASER, View
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.recorder import drive_and_sense, operator_for
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.envs.tasks.task import Looking
from refseq_bench.sim.envs.worlds.named import world_named
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.plans.load import written_ns

LEARNING = Trigger()
"""When views are taken on the drive that is learnt."""
FAMILIAR_SEED = 20080
"""The seed of the drive that is learnt, so that all environments have the same map; any number will do."""


def familiar(world: str, light: str, robot: str, route: str) -> Map:
    """The reference sequence of one drive along a route, the same object for all who ask; takes some seconds.

    A world whose file is written anew is driven anew. An operator leads the robot, as for any recording. Raises
    ``SimError``.
    """
    return _driven(world, written_ns(world), light, robot, route)


@lru_cache(maxsize=8)
def _driven(world: str, _written: int, light: str, robot: str, route: str) -> Map:
    settings = BenchSettings(renderer=RendererKind.NONE, cameras=())
    place = world_named(world, light, pictured=False)
    with Bench(place, robots.load(robot), route=route, seed=FAMILIAR_SEED, settings=settings) as bench:
        taken = drive_and_sense(bench, operator_for(bench, FAMILIAR_SEED), LEARNING)
        return learn([one.view for one in taken], sensors=(LASER,), profile=BEST)


def places_of(map_: Map) -> NDArray[np.float64]:
    """Where the places truly are, (K, 2) [m]."""
    return np.array([(pose.x, pose.y) for pose in map_.poses if pose is not None])


class Following:
    """A localiser that is given views as the robot goes; ``belief`` is its answer to the last one."""

    def __init__(self, map_: Map, bench: Bench, looking: Looking) -> None:
        self._localiser, self._bench = Localiser(map_), bench
        self._trigger = Trigger(distance=looking.distance, turn=looking.turn)
        self._last: Pose | None = None
        self._odometry, self._moved = bench.odometry, Moved()
        self.look()

    def after_period(self) -> None:
        """Note what the odometer counted in a control period, and look where it is time to."""
        before, self._odometry = self._odometry, self._bench.odometry
        self._moved.add(before, self._odometry, CONTROL_PERIOD)
        if self._trigger.fires(self._moved):
            self.look()

    @property
    def gone(self) -> float:
        """Way of the odometer since the last view [m]."""
        return self._moved.distance

    def look(self) -> None:
        """Give the localiser a view of here and now."""
        bench = self._bench
        self._odometry, self._moved = bench.odometry, Moved()
        distance, turn = motion_between(self._last, self._odometry) if self._last else (0.0, 0.0)
        self._last = self._odometry
        view = View(bench.time, scan=bench.new_scan(), distance=distance, turn=turn)
        self.belief: Belief = self._localiser.update(view)
