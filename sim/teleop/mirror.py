"""A copy of a bench's world for a viewer: nothing done to it reaches the robot or its sensors."""

import copy
import re

import mujoco
import numpy as np

from refseq_bench.sim.bench.bench import Bench

BRIGHT = 60_000.0
"""Ambient light [lx]; viewers expose as for a sunny day, so less looks dim."""
ROOF_GROUP = 1
"""The group of geoms that is hidden in the view from above: ceilings and lamps alone."""
OVERHEAD = re.compile(r"(ceiling|lamp):.*|door:[^:]*:room:ceiling")
"""Names of those geoms."""
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class WorldMirror:
    """The copy, evenly lit by a headlight and from all sides at any hour.

    Sun and lamps are off: their shadows cost a viewer without a graphics card the most.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.model = copy.deepcopy(bench.model)
        self.data = mujoco.MjData(self.model)
        self._light()
        for geom in range(self.model.ngeom):
            if OVERHEAD.fullmatch(self.model.geom(geom).name):
                self.model.geom_group[geom] = ROOF_GROUP
        self._state = np.empty(mujoco.mj_stateSize(self.model, STATE))
        self.follow()

    def _light(self) -> None:
        model = self.model
        image = model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
        model.light_active[:] = image
        model.light_intensity[image] = BRIGHT / np.pi
        model.vis.headlight.active = 1

    def follow(self) -> None:
        """Copy the bench's state."""
        mujoco.mj_getState(self._bench.model, self._bench.data, self._state, STATE)
        mujoco.mj_setState(self.model, self.data, self._state, STATE)
