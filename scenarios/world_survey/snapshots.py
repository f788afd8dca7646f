"""Pictures of a world from places along a route, in one light after another: no drive, the robot is put there."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.polyline import Polyline
from refseq_bench.worlds.plans.load import load_plan


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Pictures of the cameras ``along`` the route [m] in one light; ``images`` by camera, (height, width) uint8."""

    light: str
    along: float
    pose: Pose
    images: Mapping[str, NDArray[np.uint8]]


def snapshots(drive: Drive, lights: Sequence[str], places: Sequence[float]) -> Iterator[Snapshot]:
    """Put the robot of ``drive`` at each of the ``places`` along its route [m], in each of the ``lights``.

    Raises ``ScenarioError`` for a place that is not on the route.
    """
    for light in lights:
        with open_bench(replace(drive, light=light)) as bench:
            for along in places:
                bench.place(pose_along(bench.route, along))
                view = bench.sense()
                yield Snapshot(light, along, bench.pose, view.images)


def places_on(drive: Drive, along: Sequence[float] | None) -> tuple[float, ...]:
    """The places asked for along the route of ``drive`` [m], or three of them, a quarter of the route apart.

    Raises ``ScenarioError`` for a route that is not there, and for places that are not on it.
    """
    routes = load_plan(drive.world).routes
    if drive.route not in routes:
        raise ScenarioError(f"unknown route {drive.route!r} in world {drive.world!r}; valid are {', '.join(routes)}")
    route = np.array(routes[drive.route])
    for place in along or ():
        pose_along(route, place)
    length = Polyline(route).length
    return tuple(along or (round(share * length, 1) for share in (0.25, 0.5, 0.75)))


def pose_along(route: NDArray[np.float64], along: float) -> Pose:
    """The pose at path length ``along`` [m] on a polyline ``route`` (n, 2) [m], heading along it."""
    way = Polyline(route)
    if not 0.0 <= along <= way.length:
        raise ScenarioError(f"place {along:g} m is not on the route; valid is 0 to {way.length:g}")
    return way.pose(along)
