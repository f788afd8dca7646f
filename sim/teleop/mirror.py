"""A copy of a bench's world to look at: whatever a viewer does with it, the robot and its sensors notice nothing."""

import copy

import mujoco
import numpy as np

from sim.bench.bench import Bench

BRIGHT = 60_000.0
"""Light from all sides [lx] in which things look as usual in a viewer: these expose as for a sunny day."""
ROOF_GROUP = 1
"""A group of geoms that nothing else is in; what is overhead is put there, so that one can look from above."""
OVERHEAD = ("ceiling", "lamp_")
"""Parts of names of such geoms."""
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class Shadow:
    """The copy, in even light of a headlight and from all sides, at any hour; the cameras' pictures tell of the hour.

    Sun and lamps are off: their shadows are what costs a viewer without a graphics card the most.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.model = copy.deepcopy(bench.model)
        self.data = mujoco.MjData(self.model)
        self._light()
        for geom in range(self.model.ngeom):
            if any(part in self.model.geom(geom).name for part in OVERHEAD):
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
        """Take over how everything stands on the bench."""
        mujoco.mj_getState(self._bench.model, self._bench.data, self._state, STATE)
        mujoco.mj_setState(self.model, self.data, self._state, STATE)
