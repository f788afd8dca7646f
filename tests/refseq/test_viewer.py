import math
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rerun.chunk import RrdReader
from rerun.experimental import ViewerClient

from refseq import viewer
from refseq.belief import Stage
from refseq.errors import RefseqError
from refseq.view import Pose, Scan, View
from refseq.viewer import write_recording
from tests.support import certain, corridor_comparison, peaked

COUNT = 12
pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take


@pytest.fixture(scope="module")
def comparison() -> Any:
    return corridor_comparison(seed=3, count=COUNT, size=48)


@pytest.fixture(scope="module")
def recording(comparison: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("viewer") / "run.rrd"
    write_recording(path, comparison.reference_views, comparison.query_views, comparison.beliefs, name="16 → 18")
    return path


def column(path: Path, entity: str, name: str, static: bool = False) -> list[Any]:
    """Values of one component in the order of the views."""
    found = []
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and chunk.is_static == static and name in batch.schema.names:
            views = batch.column("view").to_pylist() if not static else range(batch.num_rows)
            found += zip(views, batch.column(name).to_pylist(), strict=True)
    return [value for _, value in sorted(found, key=lambda pair: pair[0])]


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def decoded(blob: list[Any]) -> Any:
    return cv2.imdecode(np.array(blob[0], dtype=np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)


def test_file_passes_rerun_s_own_check(recording: Path) -> None:
    check = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", recording], capture_output=True, check=False
    )
    assert check.returncode == 0, check.stderr.decode()


def test_a_layout_goes_with_the_data(recording: Path) -> None:
    assert len(RrdReader(recording).recordings()) == 1
    assert len(RrdReader(recording).blueprints()) == 1


def test_cameras_show_now_and_the_place_that_is_believed_in(recording: Path, comparison: Any) -> None:
    answers = comparison.beliefs[Stage.CHAIN]
    for camera in ("forward", "lateral"):
        now = column(recording, f"/now/{camera}", "EncodedImage:blob")
        place = column(recording, f"/place/{camera}", "EncodedImage:blob")
        for t in range(COUNT):
            there = comparison.reference_views[answers[t].best].images[camera]
            assert np.abs(decoded(now[t]) - comparison.query_views[t].images[camera]).mean() < 4
            assert np.abs(decoded(place[t]) - there).mean() < 4


def test_scan_in_plan_lies_on_the_walls(tmp_path: Path) -> None:
    """A robot that looks along +y in a corridor along y sees walls at x = 3 ± 1.2 m, wherever it stands."""
    straight = corridor_comparison(count=COUNT, size=24).query_views
    turned = [replace(v, truth=Pose(3.0 - v.truth.y, v.truth.x, math.pi / 2)) for v in straight if v.truth is not None]
    write_recording(tmp_path / "a.rrd", [], turned, {}, name="turned")
    for points in column(tmp_path / "a.rrd", "/plan/scan", "Points2D:positions"):
        x = np.array(points)[:, 0]
        on_wall = np.minimum(abs(x - 1.8), abs(x - 4.2)) < 1e-3
        assert on_wall.sum() > 300
        assert (np.array(points)[:, 1] < 0).all()  # north, shown upwards


def test_scan_beside_the_robot_has_left_on_the_left(tmp_path: Path) -> None:
    ahead_and_left = Scan(np.array([2.0, np.inf, 3.0], np.float32), start=0.0, step=np.pi / 4)
    write_recording(tmp_path / "a.rrd", [], [View(0.0, scan=ahead_and_left)], {}, name="two beams")
    (points,) = column(tmp_path / "a.rrd", "/laser/scan", "Points2D:positions")
    np.testing.assert_allclose(points, [[0, -2], [-3, 0]], atol=1e-6)


def test_time_runs_by_view_by_clock_and_by_distance(recording: Path) -> None:
    chunk = next(c for c in RrdReader(recording).stream() if c.entity_path == "/now/forward" and not c.is_static)
    batch = chunk.to_record_batch()
    assert batch.column("view").to_pylist() == list(range(COUNT))
    assert [t.total_seconds() for t in batch.column("time").to_pylist()] == [2.0 * k for k in range(COUNT)]
    assert batch.column("distance_cm").to_pylist() == [85 * k for k in range(COUNT)]


def test_belief_map_is_brightest_where_the_probability_is(tmp_path: Path, comparison: Any) -> None:
    steps = [certain(COUNT, (5 * t) % COUNT) for t in range(COUNT)]
    path = tmp_path / "a.rrd"
    write_recording(path, comparison.reference_views, comparison.query_views, {Stage.PRIOR: steps}, name="steps")
    (blob,) = column(path, "/belief/prior/map", "EncodedImage:blob", static=True)
    assert (COUNT - 1 - decoded(blob).argmax(axis=0)).tolist() == [(5 * t) % COUNT for t in range(COUNT)]


def test_bars_lost_and_entropy_are_the_belief_s(recording: Path, comparison: Any) -> None:
    answers = comparison.beliefs[Stage.CHAIN]
    bars = column(recording, "/bars/belief", "BarChart:values")
    np.testing.assert_allclose([bar[0]["buffer"] for bar in bars], [a.places for a in answers], rtol=1e-6)
    for stage in Stage:
        lost = column(recording, f"/lost/{stage.value}", "Scalars:scalars")
        entropy = column(recording, f"/entropy/{stage.value}", "Scalars:scalars")
        assert lost == [[a.lost] for a in comparison.beliefs[stage]]
        assert entropy == [[a.entropy] for a in comparison.beliefs[stage]]


def test_any_method_is_shown_by_its_name(tmp_path: Path, comparison: Any) -> None:
    """Not only stages: names with strokes and colons are one part of a path, and the last of them is the one shown."""
    steps, still = [certain(COUNT, (5 * t) % COUNT) for t in range(COUNT)], [certain(COUNT, 2, lost=0.7)] * COUNT
    path = tmp_path / "a.rrd"
    answers = {"best/prior": still, "package.module:Class": steps}
    write_recording(path, comparison.reference_views, comparison.query_views, answers, name="two")
    for part, beliefs in ((r"best\/prior", still), (r"package.module\:Class", steps)):
        (blob,) = column(path, f"/belief/{part}/map", "EncodedImage:blob", static=True)
        assert (COUNT - 1 - decoded(blob).argmax(axis=0)).tolist() == [belief.best for belief in beliefs]
        assert column(path, f"/lost/{part}", "Scalars:scalars") == [[belief.lost] for belief in beliefs]
    bars = column(path, "/bars/belief", "BarChart:values")
    np.testing.assert_allclose([bar[0]["buffer"] for bar in bars], [belief.places for belief in steps], rtol=1e-6)
    with pytest.raises(RefseqError, match="method 'best/prior': 1 answers"):
        write_recording(path, comparison.reference_views, comparison.query_views, {"best/prior": steps[:1]}, name="one")


def test_true_place_is_the_nearest_that_looks_the_same_way(tmp_path: Path) -> None:
    out_and_back = [View(0.0, truth=Pose(x, 0.0, 0.0)) for x in (0, 1, 2)]
    out_and_back += [View(0.0, truth=Pose(x, 0.0, math.pi)) for x in (2, 1, 0)]
    query = [View(0.0, truth=Pose(0.9, 0.2, heading)) for heading in (0.1, 3.0)]
    query += [View(0.0), View(0.0, truth=Pose(1.0, 1.6, 0.0))]
    beliefs = {Stage.CHAIN: [peaked(6, 1.0, 1.0)] * 4}
    write_recording(tmp_path / "a.rrd", out_and_back, query, beliefs, name="out and back")
    bars = column(tmp_path / "a.rrd", "/bars/truth", "BarChart:abscissa")
    assert [bar and bar[0]["buffer"] for bar in bars] == [[1.0], [4.0]]


def test_a_drive_alone_and_a_map_alone_open_too(tmp_path: Path, comparison: Any) -> None:
    write_recording(tmp_path / "drive.rrd", [], comparison.query_views, {}, name="drive")
    assert {"/now/forward", "/laser/scan", "/plan/drive"} <= entities(tmp_path / "drive.rrd")
    places = [View(float(k), truth=view.truth) for k, view in enumerate(comparison.reference_views)]
    write_recording(tmp_path / "map.rrd", places, [], {}, name="map")
    assert "/plan/drive" in entities(tmp_path / "map.rrd")
    assert not any(path.startswith(("/now", "/lost")) for path in entities(tmp_path / "map.rrd"))


def test_without_truth_the_plan_is_dead_reckoned(tmp_path: Path) -> None:
    quarter = [View(float(k), distance=1.0 if k else 0.0, turn=math.pi / 2 if k else 0.0) for k in range(5)]
    write_recording(tmp_path / "a.rrd", [], quarter, {}, name="square")
    ((corners,),) = column(tmp_path / "a.rrd", "/plan/drive", "LineStrips2D:strips", static=True)
    np.testing.assert_allclose(corners[0], corners[-1], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(np.diff(corners, axis=0), axis=1), 1.0, atol=1e-6)


def test_a_missing_picture_leaves_its_panel_empty(tmp_path: Path, comparison: Any) -> None:
    views = [replace(view, images={}) if t == 4 else view for t, view in enumerate(comparison.query_views)]
    write_recording(tmp_path / "a.rrd", [], views, {}, name="blink")
    pictures = column(tmp_path / "a.rrd", "/now/forward", "EncodedImage:blob")
    assert [t for t, picture in enumerate(pictures) if not picture] == [4]


def test_answers_that_do_not_fit_are_refused_and_leave_no_file(tmp_path: Path, comparison: Any) -> None:
    path = tmp_path / "a.rrd"
    path.write_bytes(b"old")
    with pytest.raises(
        RefseqError, match=r"stage 'chain': 1 answers over .*; valid is one answer for each of 12 views"
    ):
        write_recording(
            path, comparison.reference_views, comparison.query_views, {Stage.CHAIN: [certain(COUNT, 0)]}, name="short"
        )
    with pytest.raises(RefseqError, match="nothing to show"):
        write_recording(path, [], [], {}, name="nothing")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_showing_without_a_display_says_what_is_missing(monkeypatch: pytest.MonkeyPatch, comparison: Any) -> None:
    monkeypatch.setattr(viewer.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RefseqError, match="no display"):
        viewer.show([], comparison.query_views, {}, name="blind")


@contextmanager
def headless_viewer(path: Path) -> Iterator[ViewerClient]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    client = ViewerClient.spawn(headless=True, port=port, executable_path=str(Path(sys.executable).parent / "rerun"))
    try:
        client.open(str(path))
        yield client
    finally:
        client.quit()


@pytest.mark.slow
def test_every_panel_opens_without_complaint(recording: Path) -> None:
    with headless_viewer(recording) as client:
        for _ in range(60):
            views = client.get_state().views
            if len(views) >= 12:
                break
            time.sleep(0.5)
        client.set_time("view", sequence=COUNT // 2, play_state="paused")
        time.sleep(2)
        views = client.get_state().views
        assert len(views) == 12  # 2 × 2 cameras, laser, plan, 3 belief maps, bars, lost, entropy
        assert [report for view in views for report in view.reports] == []
