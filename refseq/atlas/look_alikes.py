"""Look-alikes along one path: a stretch whose walls the same path sees again, where its odometry says it is elsewhere.

Identical wings lie on each other to the last beam. Another path that comes by there fits both of them, and which of the
two the words prefer is chance: a join that tells of such a stretch and hardly of more is doubtful, however much its
walls are alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.consistency import Verdict
from refseq.atlas.found import FoundOverlap


@dataclass(frozen=True, slots=True)
class LookAlike:
    """Views ``first`` to ``last`` of a ``path``, whose walls its views ``again`` (first, last) show as well."""

    path: int
    first: int
    last: int
    again: tuple[int, int]


def look_alikes(found: Sequence[FoundOverlap], verdicts: Sequence[Verdict | None], same: float) -> list[LookAlike]:
    """Both stretches of each loop that is contradicted though its scans are alike to ``same``."""
    known = []
    for one, verdict in zip(found, verdicts, strict=True):
        alike = one.overlap.alike
        if one.is_loop and verdict is Verdict.CONTRADICTED and alike is not None and alike >= same:
            (a, b), (c, d) = one.views[0].tolist(), one.views[-1].tolist()
            known += [LookAlike(one.one, a, c, (b, d)), LookAlike(one.one, b, d, (a, c))]
    return known


def told_inside(
    path: int, views: NDArray[np.intp], along: NDArray[np.float64], known: Sequence[LookAlike], least: float
) -> LookAlike | None:
    """The look-alike beyond which some ``views`` of a path tell of less than ``least`` [m], if there is one.

    ``along`` (V,) are the way's lengths [m] at all views of the path.
    """
    first, last = along[views.min()], along[views.max()]
    for one in (each for each in known if each.path == path):
        inside = min(last, along[one.last]) - max(first, along[one.first])
        if inside > 0 and last - first - inside < least:
            return one
    return None
