"""UMBmark's figures in a table, and the errors at the squares' ends in a picture."""

import math

import matplotlib as mpl
from matplotlib.figure import Figure

from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.sim.acceptance.umbmark import Direction, Umbmark

NAMES = {Direction.CLOCKWISE: "clockwise", Direction.COUNTER_CLOCKWISE: "counter-clockwise"}
LOOKS = {Direction.CLOCKWISE: ("#0072b2", "o"), Direction.COUNTER_CLOCKWISE: ("#d55e00", "s")}


def umbmark_table(found: Umbmark) -> TextTable:
    """All figures, for a terminal of 80 characters."""
    table = TextTable("figure", ">value", "", title=_title(found))
    for direction in Direction:
        centre = found.centre(direction)
        table.add_row(f"centre of {NAMES[direction]} ends", f"{1000 * centre.x:+.1f}, {1000 * centre.y:+.1f}", "mm")
        table.add_row("  spread of single runs", f"{1000 * found.spread(direction):.1f}", "mm")
    table.add_row("E max,syst", f"{1000 * found.worst:.1f}", "mm")
    table.add_row("α, each turn too short by", f"{math.degrees(found.alpha):+.4f}", "°")
    table.add_row("β, each side bends left by", f"{math.degrees(found.beta):+.4f}", "°")
    table.add_row("E b, true over believed track", f"{found.track_ratio:.5f}", "")
    table.add_row("E d, right over left wheel", f"{found.wheel_ratio:.5f}", "")
    for name, now, then in (
        ("left wheel", found.believed.left_radius, found.corrected.left_radius),
        ("right wheel", found.believed.right_radius, found.corrected.right_radius),
        ("track", found.believed.track, found.corrected.track),
    ):
        table.add_row(f"{name}, believed → corrected", f"{1000 * now:.3f} → {1000 * then:.3f}", "mm")
    return table


def _title(found: Umbmark) -> str:
    runs = len(found.returns) // len(Direction)
    return f"{found.robot}: {runs} squares of {found.side:g} m each way"


def umbmark_picture(found: Umbmark) -> Figure:
    """Draw by how much the odometer was off at each square's end, and the centres of both ways round."""
    with mpl.rc_context({**AS_WRITTEN, "font.size": 9, "svg.fonttype": "none"}):
        figure = Figure(figsize=(7.0, 6.0), dpi=100, layout="constrained")
        axes = figure.add_subplot(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title=_title(found))
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
