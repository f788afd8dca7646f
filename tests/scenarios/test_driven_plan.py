"""A plan is known by what a recording holds of it, not by its name; recordings that hold none are known by that."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from refseq_bench.scenarios.driven_plan import driven_plan, known_by_name
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import described, open_bench
from refseq_bench.scenarios.drives.route import plan_of
from refseq_bench.scenarios.report.outline import outline_for
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.drawing.outline import outline_of
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import FloorPlan, Furniture
from tests.support import corridor_comparison

OFFICES = load_plan("offices")
NAMESAKE = OFFICES.model_copy(update={"name": "hallway"})
BARE = OFFICES.model_copy(update={"poster": (), "furniture": ()})

TROLLEY = Furniture(name="trolley", kind="table", at=(6.0, 0.8), width=0.9, depth=0.5, height=0.9, material="metal")
ALTERED = OFFICES.model_copy(update={"furniture": (TROLLEY,)})


def told(plan: FloorPlan, **more: str) -> dict[str, object]:
    return {"world": plan.name, "config": json.dumps({"plan": plan.model_dump(mode="json")}), **more}


@pytest.mark.parametrize("more", [{}, {"change": "busy", "change_seed": 7}, {"waypoints": ((2.0, 0.0), (9.0, 0.0))}])
def test_a_drive_in_a_world_of_the_library_is_known_by_its_name(more: dict[str, Any]) -> None:
    drive = Drive(world="offices", renderer=RendererKind.NONE, **more)
    with open_bench(drive) as bench:
        metadata = described(bench, drive, None)
    assert known_by_name(metadata)
    assert driven_plan(metadata) == plan_of(drive)


@pytest.mark.parametrize("change", ["none", "people=0.5"])
def test_a_plan_of_one_s_own_is_not_known_by_a_name_of_the_library(change: str) -> None:
    metadata = told(NAMESAKE, change=change)
    assert not known_by_name(metadata)
    assert driven_plan(metadata) == NAMESAKE
    assert known_by_name(told(BARE, change=change)) == (change != "none"), "on another day a poster may be gone"


@pytest.mark.parametrize(
    ("metadata", "world"),
    [
        ({"world": "offices"}, "offices"),
        ({"world": "offices", "config": "{}"}, "offices"),
        ({"world": "offices", "config": "["}, "offices"),
        ({"world": "offices", "config": '{"plan": {"name": "offices"}}'}, "offices"),
        (told(NAMESAKE, world="offices"), "offices"),
        ({"world": "abbey"}, None),
        ({"world": "abbey.toml"}, None),
        ({}, None),
    ],
)
def test_without_a_plan_a_name_counts(metadata: dict[str, object], world: str | None) -> None:
    assert known_by_name(metadata) is (world is not None)
    assert driven_plan(metadata) == (world and load_plan(world))


def test_a_report_draws_the_walls_that_the_query_was_driven_between() -> None:
    def walls(query: dict[str, object], *more: dict[str, object]) -> Any:
        return outline_for([Comparison("one", (), told(OFFICES), (), one, {}) for one in (query, *more)])

    np.testing.assert_equal(walls(told(ALTERED)), outline_of(ALTERED))
    np.testing.assert_equal(walls(told(NAMESAKE)), outline_of(OFFICES))
    np.testing.assert_equal(walls(told(ALTERED), told(OFFICES)), outline_of(ALTERED))
    assert walls({}) is None, "where the query was nobody knows"


def test_of_runs_it_draws_the_walls_of_the_one_that_has_true_poses() -> None:
    told_poses = corridor_comparison(count=3, size=24)
    drawn = replace(told_poses, query_metadata=told(ALTERED))
    blind = [replace(view, truth=None) for view in told_poses.query_views]
    without = replace(told_poses, query_views=blind, query_metadata=told(OFFICES))
    np.testing.assert_equal(outline_for([without, drawn]), outline_of(ALTERED))
