"""Read a log of any kind as a recording."""

from dataclasses import replace
from pathlib import Path

from refseq.logs.kinds import open_log
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.plan import plan_views
from refseq.logs.recording import Recording
from refseq.logs.trajectories.table import PoseTable
from refseq.logs.trajectory import Trajectory


def read_recording(
    path: Path | str,
    options: PairingOptions | None = None,
    *,
    views: slice | None = None,
    thin: float | None = None,
    odometry: str | Trajectory | PoseTable | None = None,
    truth: str | Trajectory | PoseTable | None = None,
) -> Recording:
    """Read the views of a log of any kind.

    ``views`` are the indices of those to read, before thinning; ``thin`` [m] keeps one whenever so much odometry has
    been added up. ``odometry`` and ``truth`` name topics, or are trajectories or tables of poses
    from elsewhere (``refseq.logs.trajectories``). Only the pictures of the
    views that are kept are decoded.

    Raises ``LogError`` when the log is missing, of no known kind, or holds no view.
    """
    chosen = options or PairingOptions()
    if odometry is not None:
        chosen = replace(chosen, odometry=odometry)
    if truth is not None:
        chosen = replace(chosen, truth=truth)
    plan = plan_views(open_log(path), chosen)
    if views is not None:
        plan = plan.between(views)
    return (plan.thinned(thin) if thin else plan).recording()
