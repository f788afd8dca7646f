"""The tabs of atlas and mission in Rerun's own viewer, without a display: each panel opens, and none complains."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from rerun.experimental import ViewerClient

from refseq.access.listener import free_port
from refseq.atlas.merge import merge_maps
from refseq.belief import Belief, Stage
from refseq.map.localiser import localise
from refseq.map.profile import BEST
from refseq.missions import Executor, as_learnt
from refseq.planar import Pose
from refseq.view import View
from refseq.viewer.map.tab import MapTab
from refseq.viewer.mission.record import Recorder
from refseq.viewer.mission.tab import MissionTab
from refseq.viewer.recording import write_recording
from refseq.viewer.tab import Tab
from tests.refseq.missions.on_a_line import Line, right, way
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import views_of
from tests.refseq.walks import Town


def an_atlas() -> Tab:
    town = Town(density=8.0)
    walks = [town.learnt(legs, n, BEST) for n, legs in enumerate([[("A", 0, 15), ("B", 0, 20)], [("B", 0, 25)]])]
    atlas = merge_maps(named_maps(["a", "b"], walks)).map
    drive = town.views([("A", 5, 15), ("B", 0, 10)], 9)
    answers = {str(stage): found for stage, found in localise(atlas, drive, stages=[Stage.CHAIN]).items()}
    return MapTab(atlas, drive=drive, answers=answers)


def a_mission() -> Tab:
    line_way = way(12.0)
    recorder, executor = Recorder(), Executor(as_learnt(line_way))
    knows = right(line_way)

    def seen(number: int, x: float) -> Belief:
        belief = knows(number, x)
        recorder.saw(View(float(number), {"camera": np.full((24, 32), 90, np.uint8)}), belief)
        return belief

    Line(executor, seen).run(each=lambda line: recorder.note(executor, Pose(line.x, 0.2, 0.0)))
    places = np.stack([line_way.along, np.zeros(len(line_way.along))], axis=1)
    return MissionTab(recorder.record(executor.plan, places))


@contextmanager
def headless_viewer(path: Path) -> Iterator[ViewerClient]:
    """A viewer without a window that has a file open."""
    program = Path(sys.executable).parent / "rerun"
    client = ViewerClient.spawn(headless=True, port=free_port(), executable_path=str(program))
    try:
        client.open(str(path))
        yield client
    finally:
        client.quit()


@pytest.mark.slow
@pytest.mark.parametrize("made", [an_atlas, a_mission])
def test_every_panel_opens_without_complaint(made: Callable[[], Tab], tmp_path: Path) -> None:
    tab = made()
    write_recording(tmp_path / "a.rrd", [tab], name="panels")
    expected = len(list(views_of(tab.layout())))
    with headless_viewer(tmp_path / "a.rrd") as client:
        for _ in range(120):
            if len(client.get_state().views) >= expected:
                break
            time.sleep(0.5)
        client.set_time("view", sequence=5, play_state="paused")
        time.sleep(2)
        views = client.get_state().views
        assert len(views) == expected
        assert [report for view in views for report in view.reports] == []
