"""Last fixes: the odometer since places that the chain was sure of speaks against places where the robot cannot be.

A robot that leaves its path may meet, view after view, what hangs on a stretch of it somewhere else. Views do not tell
the two apart, the odometer does: the robot has come ten metres since it was last sure of its place, and that stretch is
thirty from there. So its way by the odometer since each of the last fixes is laid at the place of that fix on its path,
whose own odometry tells where all other places lie to it. A place that is farther off than both may be wrong is spoken
against, and no place is ever spoken for: the promise of evidence holds whatever the odometer does.

A carried robot is where its odometer says it is not. Hence a fix is forgotten when it may well have been carried since,
which pictures and scans tell step by step (``Measurement.log_ratio_carried``). One sensor alone tells it too seldom:
without a camera and another one no fix is remembered.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_expit

from refseq.belief import Belief
from refseq.map.map import Map
from refseq.map.matcher import Measurement, wanted_of
from refseq.map.tracking.sure import sure_place
from refseq.planar import Pose, after_motion, in_world, relative_pose, wrap, wrapped

APART = 4.0
"""Way between two fixes that are remembered [m]: nearer ones tell the same."""
NEAR, DRIFT = 1.0, 0.2
"""A place may lie so far off [m], and by so much more for each metre of both ways: what wheels drift by (0050)."""
ALIKE, BEND = math.radians(30.0), math.radians(1.0)
"""The same for the heading, [rad] and [rad/m]."""
SPREAD, HEADING_SPREAD = 0.5, math.radians(15.0)
"""Beyond that the ratio falls as a normal density does, of so much of the distance that is allowed, and [rad]."""
LEAST = 0.03
"""The least ratio of a view."""
DOUBT = 0.05
"""A fix is forgotten when the robot was carried since with a larger chance than this."""


class _Track(NamedTuple):
    """A path: the ``places`` (K,) that its views hold, counted through, and ``along`` (K,) [m] and ``poses`` (K, 3).

    Headings are wrapped.
    """

    places: NDArray[np.intp]
    along: NDArray[np.float64]
    poses: NDArray[np.float64]


class _Fix(NamedTuple):
    """A sure view: the tracks that run through its place, at which view; the robot's pose, its way, and ``stayed``.

    ``stayed`` is the log-probability that the robot was never carried up to there.
    """

    at: Sequence[tuple[_Track, int]]
    pose: Pose
    way: float
    stayed: float


class LastFixes:
    """Weighs the views of a drive by the odometer since its last fixes: ask, then let it remember what was believed.

    ``log_ratio.fixes`` of the map's profile is how many of them are remembered.
    """

    def __init__(self, map_: Map) -> None:
        self._map, self._tracks, self._carried = map_, map_.once(_tracks), map_.profile.chain.carried
        self._fixes: deque[_Fix] = deque(maxlen=int(map_.profile.log_ratio.fixes))
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._fixes.clear()
        self._pose, self._way, self._stayed = Pose(0.0, 0.0, 0.0), 0.0, 0.0

    def weighed(self, measured: Sequence[Measurement]) -> list[Measurement]:
        """A view's measurements in every sequence, with what speaks against each place."""
        self._move(measured[0])
        if not self._fixes:
            return list(measured)
        against = np.split(np.mean([self._told_by(fix) for fix in self._fixes], axis=0), self._map.first[1:-1])
        return [
            one if one.log_ratio is None else one.with_log_ratio(one.log_ratio + its)
            for one, its in zip(measured, against, strict=True)
        ]

    def remember(self, measured: Sequence[Measurement], belief: Belief) -> None:
        """Remember a view whose place the belief is sure of."""
        near = bool(self._fixes) and self._way - self._fixes[-1].way < APART
        if near or measured[0].stands:
            return
        place = sure_place(self._map, belief)
        if place is None:
            return
        at = [(track, int(view)) for track in self._tracks for view in np.flatnonzero(track.places == place)]
        if at:
            self._fixes.append(_Fix(at, self._pose, self._way, self._stayed))

    def _move(self, measured: Measurement) -> None:
        """Take the way since the last view; one that nobody measured or saw leaves nothing known of where it led."""
        if not (math.isfinite(measured.distance) and math.isfinite(measured.turn)):
            self.reset()
            return
        if not measured.stands or measured.log_ratio_carried > 0:
            self._stayed += float(log_expit(-measured.log_odds_carried(self._carried)))
            while self._fixes and -math.expm1(self._stayed - self._fixes[0].stayed) > DOUBT:
                self._fixes.popleft()
        if not measured.again:
            self._pose = after_motion(self._pose, measured.distance, measured.turn)
            self._way += abs(measured.distance)

    def _told_by(self, fix: _Fix) -> NDArray[np.float64]:
        """Log ratio of all places by the way since one fix, from log ``LEAST`` to 0; 0 of those on no path of it."""
        told = np.full(len(self._map), -np.inf)
        since = relative_pose(self._pose, fix.pose)
        for track, view in fix.at:
            way = self._way - fix.way + np.abs(track.along - track.along[view])
            np.maximum.at(told, track.places, _log_ratio(track.poses, _laid(since, track.poses[view]), way))
        return np.where(told > -np.inf, np.maximum(told, math.log(LEAST)), 0.0)


def can_trust_fixes(map_: Map, sensors: Sequence[str] | None) -> bool:
    """True where fixes can be trusted: two sensors or more are asked, or the robot is never carried.

    ``sensors`` are those of the map that are asked; None: all.
    """
    return map_.profile.chain.carried == 0 or len(wanted_of(map_, sensors)) > 1


def _tracks(map_: Map) -> list[_Track]:
    """Those of the paths whose odometry is known and not assumed."""
    if map_.odometry_is_assumed:
        return []
    tracks = [(path, map_.track(path)) for path in map_.paths]
    return [
        _Track(map_.numbered(path), path.along, np.column_stack([track[:, :2], wrapped(track[:, 2])]))
        for path, track in tracks
        if len(track)
    ]


def _laid(since: Pose, at: NDArray[np.float64]) -> Pose:
    """A pose relative to a fix, at the pose of its place."""
    x, y, heading = at.tolist()
    east, north = in_world((since.x, since.y), Pose(x, y, heading)).tolist()
    return Pose(east, north, wrap(heading + since.heading))


def _log_ratio(poses: NDArray[np.float64], expected: Pose, way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log ratio of places at ``poses`` (K, 3) where the robot is ``expected``, after so much ``way`` (K,) [m]."""
    allowed = NEAR + DRIFT * way
    away = np.hypot(poses[:, 0] - expected.x, poses[:, 1] - expected.y)
    turned = np.abs(poses[:, 2] - expected.heading)
    turned = np.minimum(turned, 2 * math.pi - turned)  # both are wrapped: twice as fast as to wrap their difference
    far = np.maximum(away - allowed, 0.0) / (SPREAD * allowed)
    bent = np.maximum(turned - (ALIKE + BEND * way), 0.0) / HEADING_SPREAD
    ratio: NDArray[np.float64] = -0.5 * (far**2 + bent**2)
    return ratio
