"""What the console tells of maps that were merged."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.cli.terminal.console import err, out
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq.atlas.merge import Merged
    from refseq.map.map import Map


def tell_merged(merged: "Merged", read: Sequence["Map"], whole: "Map", output: Path) -> None:
    """Print the joins, what is to be known of them, and how large the written map is."""
    from refseq_bench.scenarios.maps.joins import decision_table
    from refseq_bench.scenarios.maps.merge_notes import merge_notes

    if merged.decisions:
        out.print(decision_table(merged.decisions))
    for line in merge_notes(merged, read):
        say(err, f"note: {line}")
    joined = sum(decision.joined for decision in merged.decisions)
    say(
        out,
        f"{output}: {len(whole.paths)} paths, {len(whole)} places of {sum(map(len, read))}, {len(whole.links)} links, "
        f"{joined} of {len(merged.decisions)} stretches joined",
    )
