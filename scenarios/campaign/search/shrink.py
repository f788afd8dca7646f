"""Shrink what makes a method fail to a change of which no part can be left out (delta debugging, dial by dial).

After A. Zeller, R. Hildebrandt, IEEE Trans. Software Engineering 28(2), 2002: first dials are set back to where they
are easy as long as the method still fails, then each that is left is moved towards its easy value by halving.
"""

from collections.abc import Callable, Mapping

from refseq_bench.scenarios.campaign.search.dials import Dial, Point, Scale, Value

Fails = Callable[[Point], bool]


def shrunk(point: Point, dials: Mapping[str, Dial], fails: Fails) -> Point:
    """A point at which the method fails, as it does at ``point``, and none of whose dials can be set back alone.

    Halving takes it that a dial which is turned farther is no easier; where that is not so the last point is still one
    at which the method fails, only not the nearest such.
    """
    left = _set_back(dict(point), dials, fails)
    for name in list(left):
        left[name] = _nearest(name, left, dials[name], fails)
    return _set_back(left, dials, fails)


def _set_back(point: dict[str, Value], dials: Mapping[str, Dial], fails: Fails) -> dict[str, Value]:
    left = {name: value for name, value in point.items() if value != dials[name].easy}
    tried: set[str] = set()
    while name := next((one for one in left if one not in tried), None):
        without = {other: value for other, value in left.items() if other != name}
        if without and fails(without):
            left, tried = without, set()
        else:
            tried.add(name)
    return left


def _nearest(name: str, point: Mapping[str, Value], dial: Dial, fails: Fails) -> Value:
    """The value nearest to the easy one at which the method still fails, all else as in ``point``."""
    worst = point[name]
    if not isinstance(dial, Scale) or dial.easy is None or isinstance(worst, str):
        return worst
    low_end, high_end = sorted((dial.easy, worst))
    ladder = sorted([*(one for one in dial.values if low_end < one < high_end), worst], reverse=worst < dial.easy)
    low, high = 0, len(ladder) - 1
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if fails({**point, name: ladder[middle]}) else (middle + 1, high)
    return ladder[high]
