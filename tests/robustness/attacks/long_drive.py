"""A drive of ten simulated hours in circles: memory, file, clock and odometer after the first hour and the last."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.robustness.attack import HERE, Attempt, attack
from tests.robustness.memory import resident

HOURS = 10
PERIOD = 5.0
"""Time from one view to the next [s]."""
GROWTH = 1.0
"""Memory may grow by so much an hour [MB]; an hour has 720 views."""
CLOCK = 1e-6
"""Error of any view's stamp [s]."""
DRIFT = 0.01
"""Share by which the odometer's error of an hour may differ from another hour's."""


@attack(
    family="soak",
    promise="Ten simulated hours: memory stays, the file grows evenly, stamps are exact, the odometer errs by one law",
    tries=1,
    short=0,
    limit=3600.0,
)
def ten_hours(seed: int, folder: Path) -> Attempt:
    """Drive in circles and write a view every 5 s."""
    hours = list(driven(seed, folder / "drive.mcap", HOURS))
    return judged(np.array(hours), folder / "drive.mcap")


def driven(seed: int, path: Path, hours: int) -> Iterator[tuple[float, float, float]]:
    """Drive and write; memory [MB], size of the file [MB] and the odometer's error in heading [rad] after each hour."""
    from refseq.logs import RecordingWriter
    from refseq.planar import wrap
    from refseq_bench.robots import Twist
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.record import open_bench
    from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
    from refseq_bench.sim.rendering.renderer import RendererKind

    per_view, per_hour = round(PERIOD / CONTROL_PERIOD), round(3600 / CONTROL_PERIOD)
    drive = Drive(str(HERE / "scenes" / "hall.toml"), "noon", seed=seed, renderer=RendererKind.NONE)
    with open_bench(drive) as bench, RecordingWriter(path, {}) as writer:
        error = 0.0
        for step in range(hours * per_hour + 1):
            if step % per_view == 0:
                writer.write(bench.sense(), bench.odometry)
                # Between two views the error changes by less than half a turn.
                error += wrap(bench.odometry.heading - bench.pose.heading - error)
            if step and step % per_hour == 0:
                yield resident(), sum(file.stat().st_size for file in path.parent.rglob("*.mcap")) / 1e6, error
            bench.drive(Twist(0.3, 0.3))


def judged(hours: NDArray[np.float64], path: Path) -> Attempt:
    """Compare the hours, and read the file from its beginning to its end."""
    from refseq.logs import read_recording

    memory, size, error = hours.T
    grown, written, drifted = np.diff(memory), np.diff(size), np.diff(error)
    stamps = [view.time for view in read_recording(path).views]
    off = float(np.abs(np.array(stamps) - stamps[0] - PERIOD * np.arange(len(stamps))).max())
    law = float(np.ptp(drifted) / abs(drifted.mean()))
    figures = {
        "MB of memory an hour": float(np.polyfit(np.arange(len(memory)), memory, 1)[0]),
        "MB of file an hour": float(written.max()),
        "s of stamps": off,
        "rad of heading an hour": float(np.abs(drifted).max()),
    }
    reasons = {
        f"memory grows by {grown.tolist()} MB an hour": figures["MB of memory an hour"] > GROWTH,
        f"hours take {written.tolist()} MB of the file": np.ptp(written) > 0.01 * written.mean(),
        f"a stamp is off by {off} s": off > CLOCK,
        f"the odometer's error changes by {drifted.tolist()} rad an hour": law > DRIFT,
        f"{len(stamps)} views were read": len(stamps) != len(hours) * 3600 / PERIOD + 1,
    }
    fell = [reason for reason, true in reasons.items() if true]
    return Attempt("; ".join(fell) or None, figures)
