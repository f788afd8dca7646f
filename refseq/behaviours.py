"""Behaviours as drives and maps tell of them: ``MT:90@0.31; MN:5@0.5``, behind the @ how far on each begins [m]."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def begun(words: str) -> list[tuple[float, str]]:
    """Behaviours told at a place: how far behind it each begins [m], and its own words. Raises ``ValueError``."""
    several = [one.strip().partition("@") for one in words.split(";") if one.strip()]
    try:
        found = [(float(offset or 0.0), behaviour) for behaviour, _, offset in several]
    except ValueError:
        raise ValueError(f"annotations: {words!r} does not begin so many metres behind its place") from None
    if not all(math.isfinite(offset) for offset, _ in found):
        raise ValueError(f"annotations: {words!r} begins nowhere")
    return found


def behaviours_kept(told: Sequence[str], along: NDArray[np.float64], kept: Sequence[int]) -> list[str]:
    """Behaviours at the views that are ``kept``, rising, of all that were ``told`` at views ``along`` (K,) a drive [m].

    Those told at views that go are told at the kept one before, so many metres behind it. Where the first kept one
    tells none, it is the last one of those before.
    """
    found = []
    for number, end in pairwise([*kept, len(told)]):
        there = (_begun_behind(told[gone], along[gone] - along[number]) for gone in range(number + 1, end))
        found.append("; ".join(filter(None, [told[number], *there])))
    if found and not told[kept[0]]:
        before = next(filter(None, reversed(told[: kept[0]])), "")
        found[0] = "; ".join(filter(None, [before, found[0]]))
    return found


def _begun_behind(words: str, behind: float) -> str:
    """Behaviours as they are told at a place so far before theirs [m]."""
    try:
        return "; ".join(f"{behaviour}@{offset + behind:.2f}" for offset, behaviour in begun(words))
    except ValueError:
        return words  # learning refuses it, as it does at a view that stays
