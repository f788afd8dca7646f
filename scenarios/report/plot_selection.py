"""Selection of the methods that plots show; tables show all."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from refseq.belief import Stage

if TYPE_CHECKING:
    from refseq_bench.scenarios.scoring.score import Score

MOST = 6
"""Methods in one plot; more cannot be told apart at a glance, six fill two rows of heat maps."""


def select_methods(methods: Sequence[str], judged: str, scores: "Mapping[str, Score]", most: int = MOST) -> list[str]:
    """Select at most so many of the methods, in their order.

    First the one that is judged, then the other stages of its profile, the chains of other profiles, and after them
    whichever has most views right; without scores whichever comes first.
    """

    def rank(method: str) -> tuple[int, int, int]:
        right = scores[method].success.successes if method in scores else 0
        return _kind(method, judged), -right, methods.index(method)

    chosen = sorted(methods, key=rank)[:most]
    return [method for method in methods if method in chosen]


def _kind(method: str, judged: str) -> int:
    profile, _, stage = method.rpartition("/")
    if method == judged:
        return 0
    if stage not in set(Stage):
        return 3
    if profile == judged.rpartition("/")[0] and judged.rpartition("/")[2] in set(Stage):
        return 1
    return 2 if stage == Stage.CHAIN else 4
