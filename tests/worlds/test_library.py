"""What the plans of the library say of themselves."""

import itertools
import math

from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import ON_WALL

ANNEX = load_plan("annex")


def test_the_annex_repeats_a_stretch_piece_by_piece() -> None:
    def between(first: float, last: float) -> set[tuple[object, ...]]:
        """All that hangs between two lines across the second corridor, without its name, from the first line on."""
        found = set()
        for item in (item for table in ON_WALL for item in getattr(ANNEX, table)):
            wall = ANNEX.wall_named(item.wall)
            y = wall.start[1] + item.at
            if item.wall in ("left", "right") and first < y < last:
                rest = item.model_dump(exclude={"name", "at"})
                found.add((type(item).__name__, round(y - first, 6), *sorted(rest.items())))
        return found

    assert len(between(13, 25)) == 7
    assert between(13, 25) == between(27, 39)


def test_the_annex_s_detour_leaves_the_forward_route_for_the_branch_and_comes_back() -> None:
    forward, detour = ANNEX.routes["forward"], ANNEX.routes["detour"]
    branch = next(k for k, point in enumerate(detour) if point not in forward)
    left_after = sum(math.dist(a, b) for a, b in itertools.pairwise(detour[: branch + 1]))
    assert 38 < left_after < 42
    assert max(x for x, _ in detour) - max(x for x, _ in forward) > 15
    assert (detour[0], detour[-1]) == (forward[0], forward[-1])
