"""Seeds of a case's drives, and refusal of seeds whose drives would draw the same random numbers."""

from collections.abc import Iterable, Mapping

from refseq_bench.scenarios.drives.drive import QUERY_SEEDS
from refseq_bench.scenarios.errors import ScenarioError

FURTHER_SEEDS = 2 * QUERY_SEEDS
"""Added to the seed for each further reference drive: neither the same drive as another, nor as a query."""


def added_seeds(further: int) -> dict[str, int]:
    """Numbers added to a case's seed for its drives, by side: the references, so many ``further``, last the query."""
    others = {f"further.{number}": (number + 1) * FURTHER_SEEDS for number in range(further)}
    return {"reference": 0, **others, "query": QUERY_SEEDS}


def check_apart(seeds: Iterable[int], added: Mapping[str, int]) -> None:
    """Raise ``ScenarioError`` for seeds of which drives with so much ``added`` draw the same random numbers.

    Such drives wander and are noisy alike: what one of them shows would be counted twice, or tested where a parameter
    was chosen on it.
    """
    apart = sorted({abs(one - other) for one in added.values() for other in added.values() if one != other})
    taken: dict[int, tuple[str, int]] = {}
    for seed in dict.fromkeys(seeds):
        for side, more in added.items():
            other, first = taken.setdefault(seed + more, (side, seed))
            if first != seed:
                raise ScenarioError(
                    f"seeds: {first} and {seed}: {other} of {first} and {side} of {seed} would draw the same random "
                    f"numbers; valid are seeds, with those for training, that differ by none of {apart}"
                )
