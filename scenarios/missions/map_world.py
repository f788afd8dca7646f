"""The world that a map was learnt in, where it is to be driven in again."""

from refseq.map.map import Map
from refseq_bench.scenarios.driven_plan import known_by_name
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.worlds.plans.load import world_names


def check_world(map_: Map, option: str = "--world") -> None:
    """Raise ``ScenarioError`` where the bench does not have the world of a map's drive; ``option`` is how to say it."""
    told = map_.sequences[0].metadata
    if "world" not in told:
        raise ScenarioError(f"the map does not tell its world; valid is to say it: {option}")
    if known_by_name(told):
        return
    world = told["world"]
    other = f" ({option} {world} is the bench's, another one)" if world in world_names() else ""
    raise ScenarioError(
        f"the map was learnt in world {world!r:.60}, which is not the bench's own; valid is to name its plan: "
        f"{option} FILE.toml{other}"
    )
