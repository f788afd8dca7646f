"""Picture of UMBmark: the errors at the squares' ends."""

import matplotlib as mpl
from matplotlib.figure import Figure

from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.robot_checks.umbmark import NAMES, umbmark_title
from refseq_bench.sim.acceptance.umbmark import Direction, Umbmark

LOOKS = {Direction.CLOCKWISE: ("#0072b2", "o"), Direction.COUNTER_CLOCKWISE: ("#d55e00", "s")}


def umbmark_picture(found: Umbmark) -> Figure:
    """Draw by how much the odometer was off at each square's end, and the centres of both ways round."""
    with mpl.rc_context({**AS_WRITTEN, "font.size": 9, "svg.fonttype": "none"}):
        figure = Figure(figsize=(7.0, 6.0), dpi=100, layout="constrained")
        axes = figure.add_subplot(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title=umbmark_title(found))
        axes.axhline(0, color="#b0b0b0", lw=0.6, zorder=0)
        axes.axvline(0, color="#b0b0b0", lw=0.6, zorder=0)
        for direction in Direction:
            colour, marker = LOOKS[direction]
            ends = [run for run in found.returns if run.direction is direction]
            points = [1000 * run.x for run in ends], [1000 * run.y for run in ends]
            axes.scatter(*points, color=colour, marker=marker, s=22, alpha=0.7, label=NAMES[direction])
            centre = found.centre(direction)
            axes.plot([0, 1000 * centre.x], [0, 1000 * centre.y], color=colour, lw=1.0, ls="--")
            axes.plot(1000 * centre.x, 1000 * centre.y, color=colour, marker="+", ms=14, mew=1.5)
        axes.margins(0.25)
        axes.set_anchor("C")
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure
