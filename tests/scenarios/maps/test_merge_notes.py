"""Notes about a merged map: what a person may decide."""

import numpy as np

from refseq.atlas.decision import Decision
from refseq.atlas.merge import Merged, merge_maps
from refseq_bench.scenarios.maps.merge_notes import merge_notes
from tests.refseq.rooms import bits_drive, bits_map

REFUSED = Decision("a", "b", (3, 9), (12, 18), (5.1, 5.1), joined=False, why="refused")


def test_what_is_refused_and_nobody_decided_is_told_with_what_decides_it() -> None:
    map_ = bits_map(bits_drive({"bits": np.eye(20, dtype=np.bool_)}))
    assert merge_notes(merge_maps([map_]), [map_]) == []
    contested, unsupported = (
        merge_notes(Merged(map_, (REFUSED,), **{kind: (REFUSED,)}), [map_]) for kind in ("contested", "unsupported")
    )
    assert contested == [
        "a 3-9 = b 12-18 is refused, as others that contradict it would agree nearly as well: --page shows it, "
        "and --decisions decides"
    ]
    assert unsupported == [
        "1 stretch is refused for want of evidence alone: --page shows it, and --decisions joins it where a person "
        "knows better"
    ]
