"""UMBmark's figures in a table."""

import math

from refseq_bench.scenarios.tables import TextTable
from refseq_bench.sim.acceptance.umbmark import Direction, Umbmark

NAMES = {Direction.CLOCKWISE: "clockwise", Direction.COUNTER_CLOCKWISE: "counter-clockwise"}


def umbmark_table(found: Umbmark) -> TextTable:
    """All figures, for a terminal of 80 characters."""
    table = TextTable("figure", ">value", "", title=umbmark_title(found))
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


def umbmark_title(found: Umbmark) -> str:
    """Robot, number and size of the squares."""
    runs = len(found.returns) // len(Direction)
    return f"{found.robot}: {runs} squares of {found.side:g} m each way"
