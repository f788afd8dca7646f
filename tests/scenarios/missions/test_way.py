"""The way of a mission on a path that comes back to itself: all of it by default, the shortest where ends are named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.missions import as_learnt
from refseq_bench.scenarios.cli.mission import compiled_mission
from refseq_bench.scenarios.missions.page.request import MissionRequest, drawn_plan, planned
from refseq_bench.scenarios.missions.way import way_between
from tests.support import corridor_drive

COUNT = 20


@pytest.fixture
def closed() -> Map:
    """Places a metre apart on a ring: the last two are the first two again."""
    drive = corridor_drive(np.random.default_rng(3), COUNT, spacing=1.0)
    map_ = learn(drive, sensors=["laser"], features=["walls"], name="ring")
    return replace(map_, paths=(replace(map_.paths[0], loops=np.array([[0, 18], [1, 19]])),))


def test_where_nothing_is_said_a_closed_path_is_driven_all_round(closed: Map, tmp_path: Path) -> None:
    closed.save(tmp_path / "ring.refseq")
    by_command = compiled_mission(tmp_path / "ring.refseq", "learnt", None, None, None)[1]
    by_page = planned(MissionRequest(map="ring"), closed).plan.path
    for way in (way_between(closed), by_command, by_page):
        assert way.places.tolist() == list(range(COUNT))
        assert way.length == COUNT - 1


@pytest.mark.parametrize(
    ("start", "goal", "length"),
    [("ring:3", "ring:9", 6), ("ring:3", None, 16), (None, "ring:9", 9), ("ring:17", "ring:4", 5)],
)
def test_an_end_that_is_not_named_is_the_path_s(closed: Map, start: str | None, goal: str | None, length: int) -> None:
    assert way_between(closed, start, goal).length == length


def test_between_places_that_a_loop_makes_one_there_is_no_way(closed: Map) -> None:
    way = way_between(closed, "ring:0", "ring:18")
    assert (way.places.tolist(), way.length) == ([0], 0.0)
    assert as_learnt(way).goal == 0.0
    with pytest.raises(Exception, match="the way has no length"):
        drawn_plan(planned(MissionRequest(map="ring", start="ring:0", goal="ring:18"), closed), None)
