"""The desk of missions, asked as the page asks: a map is shown, a mission stated, run, watched, left in a folder."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.errors import RefseqError
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq_bench.scenarios.drives.record import Drive, record
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.missions.page.desk import MissionDesk
from refseq_bench.scenarios.missions.page.maps import MapShelf, drawn_map, place_points
from refseq_bench.scenarios.missions.page.request import MissionRequest, planned, steps_of
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.support import corridor_drive

BY_LASER = Drive(world="offices", renderer=RendererKind.NONE, behaviours=("MN:6",))
MAP = "offices.refseq"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Past the first door of the offices, learnt by the laser."""
    folder = tmp_path_factory.mktemp("maps")
    drive = record(BY_LASER, None, notes="led by itself")
    views = record(BY_LASER, folder / "offices.mcap").views
    learn(views, profile=BEST, metadata=drive.metadata).save(folder / MAP)
    return folder


@pytest.fixture
def desk(folder: Path, tmp_path: Path) -> MissionDesk:
    return MissionDesk(MapShelf(folder), tmp_path / "out", lambda line: None)


def asked(**more: Any) -> dict[str, Any]:
    drive = {"odometry": True, **more.pop("drive", {})}
    return {"map": MAP, "drive": drive, **more}


def test_a_map_is_shown_with_its_walls_doors_and_notes(folder: Path) -> None:
    shelf = MapShelf(folder)
    assert [one["name"] for one in shelf.listed()] == [MAP]
    shown = drawn_map(shelf.load(MAP))
    (path,) = shown["paths"]
    assert len(shown["places"]) == len(path["places"]) == len(shelf.load(MAP))
    assert path["length"] == pytest.approx(6.0, abs=0.1)
    assert path["doors"][0]["along"] == pytest.approx(4.7, abs=0.2)
    assert path["doors"][0]["x"] - shown["places"][0][0] == pytest.approx(4.7, abs=0.3), "the corridor runs along x"
    assert len(shown["outline"]) > 4
    assert (shown["told"]["world"], shown["told"]["notes"]) == ("offices", "led by itself")


def test_a_map_without_poses_is_drawn_as_lines() -> None:
    views = corridor_drive(np.random.default_rng(0), 5, size=96)
    map_ = learn(views, sensors=["forward"])
    bare = Map(map_.names, tuple(_without_poses(one) for one in map_.sequences), map_.paths)
    points = place_points(bare)
    assert points[:, 0] == pytest.approx(map_.paths[0].along)
    assert (points[:, 1] == 0).all()
    assert drawn_map(bare)["outline"] == []


def _without_poses(sequence: Any) -> Any:
    from dataclasses import replace

    return replace(sequence, poses=(None,) * len(sequence), odometry=np.zeros((0, 3)))


def test_a_string_is_steps_and_steps_are_a_string(folder: Path) -> None:
    assert steps_of("[LD_LA3MT90_LDMC]") == [{"at": "LD"}, {"at": "LA3", "do": "MT90"}, {"at": "LD", "do": "MC"}]
    map_ = MapShelf(folder).load(MAP)
    request = MissionRequest.read(asked(steps=steps_of("[LD_LA1]"), landmarks={"LA1": 5.5}))
    found = planned(request, map_)
    assert (found.text, found.plan.goal) == ("[LD_LA1]", 5.5)


def test_a_mission_is_run_watched_and_left(desk: MissionDesk, tmp_path: Path) -> None:
    plan = desk.plan(asked(steps=[{"at": "LD", "tasks": [{"wait": 0.5}]}, {"at": "LA1"}], landmarks={"LA1": 5.5}))
    assert plan["text"] == "[LD_LA1]"
    assert [order["tasks"] for order in plan["orders"]] == [[], ["wait 0.5 s"]]
    started = desk.start(asked(steps=[{"at": "LD", "tasks": [{"wait": 0.5}]}, {"at": "LA1"}], landmarks={"LA1": 5.5}))
    assert (started["number"], started["plan"]) == (1, plan)
    assert desk.news({})["state"] == "opening"
    with pytest.raises(ScenarioError, match="a mission runs already; valid is to wait for its end, or to abort it"):
        desk.start(asked())
    assert desk.run_next(0.0)
    news = desk.news({"number": "1"})
    assert (news["state"], news["status"]) == ("over", "completed")
    assert news["result"] == {
        "completed": True,
        "why": "",
        "touched": [],
        "left": str(tmp_path / "out" / "mission-1"),
        "photographs": [],
    }
    log = [line[2] for line in news["log"]]
    assert "done: wait 0.5 s" in log
    assert log[-1] == "the mission is completed"
    assert len(news["track"]) > 40
    assert news["believed"][0] == pytest.approx(news["robot"][0], abs=0.3)
    later = desk.news({"number": "1", "log": str(len(log)), "track": str(len(news["track"]))})
    assert (later["log"], later["track"]) == ([], [])
    assert desk.news({"number": "7", "log": "3"})["log"] == news["log"], "of another mission a page has nothing"
    assert (tmp_path / "out" / "mission-1" / "log.txt").read_text().count("\n") == len(log)


def test_a_mission_is_aborted_before_it_has_gone_anywhere(desk: MissionDesk) -> None:
    with pytest.raises(ScenarioError, match="no mission runs; there is nothing to pause"):
        desk.do({"do": "pause"})
    desk.start(asked())
    desk.do({"do": "abort"})
    assert desk.run_next(0.0)
    news = desk.news({})
    assert news["status"] == "aborted"
    assert news["result"]["completed"] is False
    assert len(news["track"]) < 3
    assert not desk.run_next(0.0), "there is no other one"


@pytest.mark.parametrize(
    ("told", "line"),
    [
        ({"map": "../offices.refseq"}, f"map '../offices.refseq' is not here; valid are {MAP}"),
        ({"map": 3}, "map = 3 is not valid"),
        ({}, "map = "),
        (asked(goal="offices:99"), "place 'offices:99': path 'offices' has "),
        (asked(goal="offices:0"), "the way has no length"),
        (asked(steps=[{"at": "LX"}]), "step 1: mission '[LX]', column 2"),
        (asked(steps=[{"at": "LD", "do": "MW"}]), "step 1: "),
        (asked(steps=[{"at": "LD", "fly": 1}]), "step.1.fly: is not known here; valid are at, do, tasks, timeout"),
        (asked(steps=[{"at": "LD", "tasks": [{"photograph": "../x"}]}]), "step.1.tasks.1.photograph = '../x' is not"),
        (asked(steps=[{"at": "LA1"}]), "mission [LA1], step 1: nobody has said where LA1 is"),
        (asked(drive={"light": "dusk"}), "unknown light 'dusk'"),
        (asked(drive={"robot": "r2d2"}), "unknown robot 'r2d2'"),
        (asked(drive={"renderer": "oil"}), "drive.renderer = 'oil' is not valid"),
        (asked(drive={"seed": -1}), "drive.seed = -1 is not valid"),
        (asked(drive={"change": "flood"}), "change 'flood': unknown 'flood'; valid is none, few, busy"),
        (asked(drive={"world": "/etc/passwd"}), "drive.world = '/etc/passwd' is not valid"),
    ],
)
def test_what_cannot_be_done_is_told_in_a_line_and_not_begun(
    desk: MissionDesk, told: dict[str, Any], line: str
) -> None:
    with pytest.raises((RefseqError, *input_errors())) as caught:
        desk.start(told)
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)
    assert desk.news({})["state"] == "idle"


def test_a_folder_without_maps_is_told(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "none.refseq"):
        with pytest.raises(ScenarioError, match="holds no map; valid is a map"):
            MapShelf(place)
