"""A copy of a bench's world to look at: whatever a viewer does with it, the robot and its sensors notice nothing."""

import copy

import mujoco
import numpy as np

from sim.bench import Bench

BRIGHT = 30_000.0
"""What light from all sides must give [lx] for grey to look grey in a viewer: these expose as for a sunny day."""
DARKEST = 1.0
"""Less light than this [lx] is shown as if it was so much: eyes do not get used to total darkness."""
ROOF_GROUP = 1
"""A group of geoms that nothing else is in; ceilings are put there, so that one can look from above."""
EYES = 1.2
"""Height at which the light is measured [m]."""
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class Shadow:
    """The copy, lit so that people can see: all lights are brighter alike, by what eyes would have got used to."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.model = copy.deepcopy(bench.model)
        self.data = mujoco.MjData(self.model)
        self._light()
        for geom in range(self.model.ngeom):
            if "ceiling" in self.model.geom(geom).name:
                self.model.geom_group[geom] = ROOF_GROUP
        self._state = np.empty(mujoco.mj_stateSize(self.model, STATE))
        self.follow()

    def _light(self) -> None:
        pose, model = self._bench.pose, self.model
        around = max(float(self._bench.world.ambient.at(np.array([pose.x, pose.y, EYES]))), DARKEST)
        image = model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
        model.light_intensity[image] = around / np.pi
        model.light_intensity *= BRIGHT / around
        model.mat_emission *= BRIGHT / around
        model.vis.headlight.active = 0

    def follow(self) -> None:
        """Take over how everything stands on the bench."""
        mujoco.mj_getState(self._bench.model, self._bench.data, self._state, STATE)
        mujoco.mj_setState(self.model, self.data, self._state, STATE)
