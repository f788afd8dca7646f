"""Choices of the user on how a log is read."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from refseq.logs.trajectories.table import PoseTable
from refseq.logs.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class PairingOptions:
    """Names and topics that the log does not tell by itself; all may be left out.

    ``names`` gives sensors their names, topic → sensor (``laser`` for a laser): ``{"/cam0/image_raw": "front"}``.
    ``topics`` are the topics of sensors to take, by default all cameras and one laser. ``leading`` is the topic or the
    name of the sensor at whose times there are views, by default the one with the lowest rate. Another sensor's sample
    belongs to a view if it is within ``tolerance`` [s] of it. ``late`` says how much later than the odometry's a
    sensor's stamps are, topic or name → [s], and those of the ``truth``; they are set back by that. ``odometry`` and
    ``truth`` are topics, or trajectories or tables of poses (``refseq.logs.trajectories``) from elsewhere; ``base`` is
    the robot's frame.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    topics: tuple[str, ...] | None = None
    leading: str | None = None
    tolerance: float | None = None
    late: Mapping[str, float] = field(default_factory=dict)
    odometry: str | Trajectory | PoseTable | None = None
    truth: str | Trajectory | PoseTable | None = None
    base: str | None = None
