"""Lines of the console on maps that were merged."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.cli.terminal.console import err, out
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq.atlas.merge import Merged
    from refseq.map.map import Map


def tell_merged(merged: "Merged", notes: Sequence[str], places: int, whole: "Map", output: Path) -> None:
    """Print the joins, what is to be known of them, and how large the map is that was written.

    ``places`` are those of all maps that it was made of.
    """
    from refseq_bench.scenarios.maps.joins import decision_table

    if merged.decisions:
        out.print(decision_table(merged.decisions))
    for line in notes:
        say(err, f"note: {line}")
    joined = sum(decision.joined for decision in merged.decisions)
    say(
        out,
        f"{output}: {plural(len(whole.paths), 'path')}, {plural(len(whole), 'place')} of {places}, "
        f"{plural(len(whole.links), 'link')}, {joined} of {plural(len(merged.decisions), 'stretch')} joined",
    )
