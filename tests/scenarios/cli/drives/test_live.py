"""``refseq localise --live``: what is believed on the way is what is believed of the recording, and what is shown."""

from pathlib import Path

import numpy as np
import pytest

from refseq.logs import read_recording
from refseq.logs.beliefs import read_beliefs
from refseq_bench.scenarios.drives.live import status
from tests.refseq.viewer.readback import empty_views, entities, values, verified
from tests.scenarios.conftest import Refseq
from tests.worlds.conftest import SMALL

STAGES = ("uniform", "prior", "chain")


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a plan and the map of its laser."""
    from refseq.map.learning import learn
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.record import record
    from refseq_bench.sim.drives.trigger import Trigger
    from refseq_bench.sim.rendering.renderer import RendererKind

    home = tmp_path_factory.mktemp("live")
    plan = home / "small.toml"
    plan.write_text(SMALL.format(top="", end=""))
    drive = Drive(world=str(plan), renderer=RendererKind.NONE, trigger=Trigger(distance=0.3))
    recording = record(drive, home / "first.mcap")
    learn(recording.views, metadata=recording.metadata).save(home / "map.refseq")
    (home / "keys.txt").write_text("0.5 forward\n6 left 0.1\n8 forward 0.3 right 0.1\n12 stop\n")
    return home


@pytest.fixture
def here(desk: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder to work in, where the desk's files lie too."""
    for name in ("small.toml", "map.refseq", "keys.txt"):
        (tmp_path / name).write_bytes((desk / name).read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


LIVE = ("live", "map.refseq", "small.toml")


@pytest.mark.quick_cases("led0")
@pytest.mark.parametrize("led", [("--distance", "0.3"), ("--distance", "0.3", "--script", "keys.txt")])
def test_beliefs_on_the_way_are_those_of_the_recording(here: Path, refseq: Refseq, led: tuple[str, ...]) -> None:
    answer = refseq(*LIVE, *led, "--rrd", "live.rrd", "--recording", "q.mcap", "-o", "live.parquet")
    assert answer.code == 0, answer.err
    afterwards = refseq("localise", "map.refseq", "q.mcap", "-o", "after.parquet")
    assert afterwards.code == 0
    live, after = (read_beliefs(here / f"{name}.parquet") for name in ("live", "after"))
    assert tuple(live) == tuple(after) == STAGES
    assert len(live["chain"]) == len(read_recording(here / "q.mcap").views) > 10
    for stage in STAGES:
        for one, other in zip(live[stage], after[stage], strict=True):
            np.testing.assert_allclose(one.places, other.places, rtol=0, atol=1e-12)
            assert (one.best, one.path) == (other.best, other.path)
            assert one.lost == pytest.approx(other.lost, abs=1e-12)
    tables = [said.out.partition("stage ")[2] for said in (answer, afterwards)]
    assert tables[0].splitlines()[:5] == tables[1].splitlines()[:5]
    assert "small.toml at 18:00" in answer.out


def test_what_is_shown_is_what_is_believed(here: Path, refseq: Refseq) -> None:
    assert refseq(*LIVE, "--distance", "0.5", "--rrd", "live.rrd", "-o", "live.parquet").code == 0
    assert verified(here / "live.rrd")
    beliefs = read_beliefs(here / "live.parquet")
    for stage in STAGES:
        shown = values(here / "live.rrd", f"/lost/map/{stage}", "Scalars:scalars", "view")
        assert np.ravel(shown) == pytest.approx([belief.lost for belief in beliefs[stage]])
    assert not [name for name in entities(here / "live.rrd") if "camera" in name]
    assert not list(here.glob("*.mcap")), "a drive is kept only where somebody asks for it"


def test_no_panel_of_a_live_drive_stays_empty(desk: Path, refseq: Refseq, here: Path) -> None:
    from refseq.map.map import Map
    from refseq.viewer.belief_log import LocaliserLayer
    from refseq.viewer.places import Places
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.live import LiveTab, scene_ahead
    from refseq_bench.sim.rendering.renderer import RendererKind

    assert refseq(*LIVE, "--distance", "0.5", "--rrd", "live.rrd").code == 0
    drive = Drive(world="small.toml", renderer=RendererKind.NONE, sensors=("laser",))
    layer = LocaliserLayer("map", STAGES, Places.of(Map.load(here / "map.refseq")))
    assert empty_views(LiveTab(scene_ahead(drive, layer.places), [layer]).layout(), here / "live.rrd") == []


def test_the_plan_ahead_holds_a_route_of_the_drive_s_own() -> None:
    from refseq.viewer.places import Places
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.live import scene_ahead

    drive = Drive(sensors=("laser",), waypoints=((70.0, 80.0), (75.0, 80.0)))
    own, usual = (scene_ahead(one, Places(())).extent for one in (drive, Drive(sensors=("laser",))))
    assert own != usual


def test_one_stage_and_a_share_asked_for(here: Path, refseq: Refseq) -> None:
    words = (*LIVE, "--distance", "0.3", "--stage", "prior", "--rrd", "live.rrd")
    assert refseq(*words, "--at-least", "1").code == 0
    below = refseq(*words, "--at-least", "100", "--change", "busy", "--seed", "5")
    assert below.code in (0, 1)
    assert ("below what was asked" in below.err) == (below.code == 1)
    assert not any(stage in below.out for stage in ("uniform", "chain"))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((*LIVE, "--script", "keys.txt", "--keys"), "--script and --keys exclude each other; valid is one of them"),
        ((*LIVE, "--rrd", "x.rrd", "--serve", "9090"), "--rrd and --serve exclude each other; valid is one of them"),
        ((*LIVE, "--rrd", "no/x.rrd"), "there is no folder no"),
        ((*LIVE, "--sensors", "sonar", "--rrd", "x.rrd"), "sonar"),
        ((*LIVE, "--route", "up", "--rrd", "x.rrd"), "unknown route 'up'"),
        ((*LIVE, "--light", "25:00", "--rrd", "x.rrd"), "25:00"),
        ((*LIVE, "--script", "none.txt", "--rrd", "x.rrd"), "none.txt: is no file"),
        (
            (*LIVE, "--distance", "-1", "--rrd", "x.rrd"),
            "--distance -1 is not valid; it should be above 0 and finite, or 0 for none by distance",
        ),
        ((*LIVE, "--connect", "rerun+http://127.0.0.1:9/proxy"), "nobody answers"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    here: Path, refseq: Refseq, words: tuple[str, ...], told: str
) -> None:
    before = sorted(here.iterdir())
    answer = refseq(*words, "--recording", "kept.mcap")
    assert answer.code == 2
    assert told in answer.err
    assert len(answer.err.strip().splitlines()) == 1
    assert sorted(here.iterdir()) == before


def test_without_a_display_it_is_told_what_else_there_is(
    here: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    answer = refseq(*LIVE)
    assert answer.code == 2
    assert answer.err.startswith("error: no display")


def test_an_interrupted_drive_keeps_its_recording(here: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch) -> None:
    from refseq.viewer.live_logger import LiveLogger

    update = LiveLogger.update

    def stop(self: LiveLogger, *words: object) -> None:
        update(self, *words)  # type: ignore[arg-type]
        if self._view == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(LiveLogger, "update", stop)
    answer = refseq(*LIVE, "--distance", "0.3", "--rrd", "live.rrd", "--recording", "q.mcap")
    assert answer.code == 130
    assert answer.err.strip().startswith("interrupted: q.partial.mcap holds 3 views, incomplete")
    assert len(read_recording(here / "q.partial.mcap").views) == 3
    assert not (here / "live.rrd").exists()


def test_a_line_tells_how_it_stands() -> None:
    from refseq.belief import Belief, Stage
    from refseq.planar import Pose
    from refseq.view import View
    from refseq.viewer.places import Places

    places = Places([Pose(0.0, 0.0, 0.0), Pose(1.0, 0.0, 0.0), None])
    view = View(1.0, truth=Pose(1.0, 0.5, 0.0))
    sure = Belief(np.array([0.1, 0.8, 0.1]), lost=0.1, best=1, entropy=0.5, path=(0, 1))
    told = status(view, 7, {Stage.UNIFORM: sure, Stage.CHAIN: sure}, places)
    assert told == "view 7: place 1 of 3, P 0.80, P(lost) 0.10, 0.5 m off"
    lost = Belief(np.array([0.1, 0.8, 0.1]), lost=0.9, best=1, entropy=0.5, path=(0, 1))
    assert status(view, 8, {Stage.CHAIN: lost}, places).endswith("P(lost) 0.90")
    alias = Belief(np.array([0.7, 0.0, 0.3]), lost=0.1, best=0, entropy=0.6, path=(0,))
    assert ", P 0.70, P(lost) 0.10, or 2 (P 0.30), " in status(view, 8, {Stage.CHAIN: alias}, places)
    nowhere = Belief(np.array([0.1, 0.1, 0.8]), lost=0.1, best=2, entropy=0.5, path=(2,))
    assert status(view, 9, {Stage.CHAIN: nowhere}, places).endswith("P(lost) 0.10")
