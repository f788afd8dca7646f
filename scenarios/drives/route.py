"""The floor plan that a drive is in, and the stretch of a route that it drives, without any physics."""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.drives.drive import OWN_ROUTE, Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.worlds.change.change import change_named, changed
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import FloorPlan


def plan_of(drive: Drive) -> FloorPlan:
    """The floor plan as it is on the drive's day, with the drive's own route. Raises ``WorldsError``."""
    plan = load_plan(drive.world)
    if drive.waypoints:
        plan = plan.model_copy(update={"routes": {**plan.routes, OWN_ROUTE: drive.waypoints}})
    return changed(plan, change_named(drive.change), drive.day)


def driven(route: NDArray[np.float64], drive: Drive) -> NDArray[np.float64]:
    """The stretch of a route (n, 2) [m] that is driven. Raises ``ScenarioError`` where the route has no such one."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(route, axis=0).T))])
    length = float(along[-1])
    end = length if drive.end is None else drive.end
    if not 0 <= drive.start < end <= length + 1e-9:
        raise ScenarioError(
            f"start {drive.start} m and end {end:g} m are no stretch of route {drive.route!r}; valid is 0 or more, "
            f"start before end, at most {length:g} m"
        )
    inner = route[(along > drive.start) & (along < end)]
    ends = [[float(np.interp(at, along, route[:, axis])) for axis in (0, 1)] for at in (drive.start, end)]
    return np.array([ends[0], *inner, ends[1]])
