"""The desk of missions, asked as the page asks: a map is shown, a mission stated, run, watched, left in a folder."""

import os
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq.belief import belief_from
from refseq.errors import RefseqError
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.missions import ADMITTED, Label, Status, parse_mission
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq_bench import worlds
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.missions.page.desk import MissionDesk
from refseq_bench.scenarios.missions.page.maps import MapShelf, drawn_map, place_points
from refseq_bench.scenarios.missions.page.request import MissionRequest, planned, steps_of
from refseq_bench.scenarios.missions.page.watch import MissionWatch
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.errors import PlanError
from tests.support import corridor_drive

BY_LASER = Drive(world="offices", renderer=RendererKind.NONE, behaviours=("MN:6",))
MAP = "offices.refseq"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Past the first door of the offices, learnt by the laser."""
    folder = tmp_path_factory.mktemp("maps")
    drive = record(BY_LASER, folder / "offices.mcap", notes="led by itself")
    learn(drive.views, profile=BEST, metadata=drive.metadata).save(folder / MAP)
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
    assert shown["refused"] == ""
    assert (shown["told"]["world"], shown["told"]["notes"]) == ("offices", "led by itself")


def test_a_map_that_was_replaced_is_read_anew_though_its_time_is_the_old_one(folder: Path, tmp_path: Path) -> None:
    """As ``cp -p`` and restored checkouts leave it."""
    there = tmp_path / "maps"
    there.mkdir()
    path = there / MAP
    shutil.copy2(folder / MAP, path)
    shelf, before = MapShelf(there), path.stat()
    first = shelf.load(MAP)
    assert shelf.load(MAP) is first
    learn(corridor_drive(np.random.default_rng(0), 5, size=96), sensors=["forward"]).save(path)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert len(shelf.load(MAP)) == 5


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


def test_the_page_is_told_all_behaviours_of_the_language(desk: MissionDesk) -> None:
    offered = desk.maps()["behaviours"]
    assert set(offered) == set(Label)
    for label, behaviours in offered.items():
        assert all(words for _, words in behaviours)
        codes = [parse_mission(f"[{label}{'' if label is Label.DOOR else 1}{code}]").steps[0] for code, _ in behaviours]
        assert list(dict.fromkeys(step.action.behaviour for step in codes if step.action)) == list(ADMITTED[label])


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
    another = desk.news({"number": "7", "log": "3"})
    assert another["log"] == news["log"], "of another mission a page has nothing"
    assert (another["map"], another["plan"]) == (MAP, plan), "nor does it show this one's map and way"
    assert (tmp_path / "out" / "mission-1" / "log.txt").read_text().count("\n") == len(log)


def test_a_mission_that_cannot_be_left_is_completed_all_the_same(folder: Path, tmp_path: Path) -> None:
    said: list[str] = []
    (tmp_path / "out").touch()
    desk = MissionDesk(MapShelf(folder), tmp_path / "out", said.append)
    desk.start(asked(steps=[{"at": "LA1"}], landmarks={"LA1": 1.0}))
    assert desk.run_next(0.0)
    result = desk.news({})["result"]
    assert (result["completed"], result["left"]) == (True, "")
    assert result["why"] == f"{tmp_path / 'out' / 'mission-1'}: cannot be written: Not a directory"
    assert said[-1] == f"mission 1: completed; {result['why']}"


@pytest.fixture
def own(folder: Path, tmp_path: Path) -> Path:
    """The map as if it had been learnt in a plan of one's own, and that beside it."""
    library = Path(worlds.__path__[0]) / "library" / "offices.toml"
    (tmp_path / "my.toml").write_text(library.read_text().replace('name = "offices"', 'name = "abbey"', 1))
    Map.load(folder / MAP).noted({"world": "abbey", "config": ""}).save(tmp_path / MAP)
    return tmp_path


def test_a_map_of_a_world_of_one_s_own_says_how_its_plan_is_named(own: Path) -> None:
    desk = MissionDesk(MapShelf(own), None, lambda line: None)
    shown = desk.map({"name": MAP})
    assert shown["refused"].startswith("the map was learnt in world 'abbey', which is not the bench's own; ")
    assert shown["refused"].endswith("valid is to name its plan: refseq mission page MAP --world FILE.toml")
    assert shown["outline"] == []
    assert desk.plan(asked())["orders"], "it is planned all the same"


def test_missions_are_run_in_the_world_that_is_named(own: Path) -> None:
    with pytest.raises(PlanError, match="unknown world 'moon'"):
        MissionDesk(MapShelf(own), None, lambda line: None, "moon")
    said: list[str] = []
    desk = MissionDesk(MapShelf(own), None, said.append, str(own / "my.toml"))
    shown = desk.map({"name": MAP})
    assert shown["refused"] == ""
    assert len(shown["outline"]) > 4
    desk.start(asked(steps=[{"at": "LA1"}], landmarks={"LA1": 1.0}))
    assert desk.run_next(0.0)
    assert said == [f"mission 1: [LA1] in {own / 'my.toml'}", "mission 1: completed"]


def test_nothing_takes_an_abort_back(desk: MissionDesk) -> None:
    desk.start(asked())
    for what in ("pause", "abort", "resume", "pause"):
        desk.do({"do": what})
    assert desk.run_next(0.0)
    assert desk.news({})["status"] == "aborted"


def test_beams_are_drawn_from_where_the_robot_is() -> None:
    """The views of a mission do not know where they were taken: their truth is not the localiser's."""
    plan: Any = SimpleNamespace(path=SimpleNamespace(along=np.array([0.0, 1.0]), places=np.array([0, 1])))
    watch = MissionWatch(plan, np.zeros((2, 2)), 0.0)
    view = View(1.0, scan=Scan(np.array([2.0, 1, 1, 1, 40], np.float32), start=0.0, step=np.pi / 8))
    watch.saw(view, belief_from([0.0, 1.0]))
    executor: Any = SimpleNamespace(
        status=Status.TRAVELLING, time=0.1, doing="MN", number=0, tasks=(), along=0.5, log=[]
    )
    watch.look(executor, SimpleNamespace(pose=Pose(3.0, 1.0, np.pi / 2)))  # type: ignore[arg-type]
    news = watch.news(0, 0, 0)
    assert news["views"] == [[0.0, 0.0, 1]]
    np.testing.assert_allclose(news["scan"], [[3.0, 3.0]], err_msg="the fifth beam is too long")


def test_two_pages_that_ask_at_once_have_each_its_own_map(folder: Path, tmp_path: Path) -> None:
    """The second map is read just before the first one is handed out."""
    for name in ("a.refseq", "b.refseq"):
        (tmp_path / name).write_bytes((folder / MAP).read_bytes())
    loaded = {}

    class Shelf(MapShelf):
        def __setattr__(self, name: str, value: Any) -> None:
            super().__setattr__(name, value)
            if name == "_kept" and value and value[0].name == "a.refseq":
                loaded["b"] = self.load("b.refseq")

    shelf = Shelf(tmp_path)
    first = shelf.load("a.refseq")
    assert first is not loaded["b"]
    assert shelf.load("b.refseq") is loaded["b"]


def test_a_map_that_is_gone_is_told(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "gone.refseq").symlink_to("nowhere")
    (tmp_path / "folder.refseq").mkdir()
    (tmp_path / MAP).write_bytes((folder / MAP).read_bytes())
    shelf = MapShelf(tmp_path)
    assert [one["name"] for one in shelf.listed()] == [MAP]
    (tmp_path / MAP).unlink()
    with pytest.raises(ScenarioError, match=f"map '{MAP}' is not here"):
        shelf.load(MAP)


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
