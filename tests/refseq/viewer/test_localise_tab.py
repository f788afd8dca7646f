import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import rerun.blueprint as rrb

from refseq.belief import Belief, PoseBeside, Stage
from refseq.errors import RefseqError
from refseq.fault import DeclaredFault, FaultKind
from refseq.logs.beliefs import read_beliefs, write_beliefs
from refseq.map.learning import learn
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq.viewer.belief_log import LocaliserLayer, beside
from refseq.viewer.layers import write_layers
from refseq.viewer.localise_tab import Answers, LocaliseTab, localise_layout
from refseq.viewer.places import Places
from refseq.viewer.recording import write_recording
from tests.refseq.viewer.readback import empty_views, entities, rows, values, verified
from tests.support import certain, corridor_comparison, peaked

COUNT = 12
pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take


@pytest.fixture(scope="module")
def comparison() -> Any:
    return corridor_comparison(seed=3, count=COUNT, size=48)


def tab_of(reference: Sequence[View], views: Sequence[View], answers: Answers, name: str = "one") -> LocaliseTab:
    return LocaliseTab(views, [LocaliserLayer(name, tuple(answers), Places.along(reference))], {name: answers})


@pytest.fixture(scope="module")
def tab(comparison: Any) -> LocaliseTab:
    return tab_of(comparison.reference_views, comparison.query_views, comparison.beliefs)


@pytest.fixture(scope="module")
def recording(tab: LocaliseTab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("localise") / "run.rrd"
    write_recording(path, [tab], name="16:00 → 18:00")
    return path


def of_views(path: Path, entity: str, component: str) -> list[Any]:
    return values(path, entity, component, "view")


def pixels(blob: list[Any]) -> Any:
    return np.asarray(cv2.imdecode(np.array(blob[0], np.uint8), cv2.IMREAD_GRAYSCALE), float)


def test_no_view_is_empty_and_the_file_is_sound(tab: LocaliseTab, recording: Path) -> None:
    assert empty_views(tab.layout(), recording) == []
    assert verified(recording)


def test_cameras_show_now_and_the_place_that_is_believed_in(recording: Path, comparison: Any) -> None:
    answers = comparison.beliefs[Stage.CHAIN]
    for camera in ("forward", "lateral"):
        now = of_views(recording, f"/now/{camera}", "EncodedImage:blob")
        place = of_views(recording, f"/place/one/{camera}", "EncodedImage:blob")
        for t in range(COUNT):
            there = comparison.reference_views[answers[t].best].images[camera]
            assert np.abs(pixels(now[t]) - comparison.query_views[t].images[camera]).mean() < 4
            assert np.abs(pixels(place[t]) - there).mean() < 4


def test_posteriors_lost_and_entropy_are_the_table_s_to_the_last_bit(
    recording: Path, comparison: Any, tmp_path: Path
) -> None:
    write_beliefs(tmp_path / "b.parquet", comparison.query_views, comparison.beliefs)
    table = read_beliefs(tmp_path / "b.parquet")
    assert list(table) == list(Stage)
    for stage, answers in table.items():
        bars = of_views(recording, f"/posterior/one/{stage}/belief", "BarChart:values")
        assert [bar[0]["buffer"] for bar in bars] == [answer.places.tolist() for answer in answers]
        assert of_views(recording, f"/lost/one/{stage}", "Scalars:scalars") == [[a.lost] for a in answers]
        assert of_views(recording, f"/entropy/one/{stage}", "Scalars:scalars") == [[a.entropy] for a in answers]


def test_faults_are_told_at_the_view_at_which_they_are_declared(comparison: Any, tmp_path: Path) -> None:
    blank = DeclaredFault("forward", FaultKind.BLANK, 3, 6.0, 12.0)
    answers = [replace(b, faults=(blank,) if 4 <= k < 8 else ()) for k, b in enumerate(comparison.beliefs[Stage.CHAIN])]
    tab = tab_of(comparison.reference_views, comparison.query_views, {Stage.CHAIN: answers})
    write_recording(tmp_path / "run.rrd", [tab], name="faults")
    assert empty_views(tab.layout(), tmp_path / "run.rrd") == []
    assert rows(tmp_path / "run.rrd", "/faults/one", "TextLog:text", "view") == [
        (0, ["sensors are watched: all well"]),
        (4, ["forward blank since view 3"]),
        (8, ["forward no more blank"]),
    ]


def test_a_drive_without_a_fault_has_no_panel_of_faults(tab: LocaliseTab) -> None:
    assert "faults" not in panels(tab.layout())
    assert "faults" in panels(localise_layout(tab.scene, tab.layers))


def panels(layout: Any) -> list[str]:
    """Origins of all panels."""
    inside = getattr(layout, "contents", None)
    if isinstance(layout, rrb.View):
        return [str(layout.origin)]
    return [origin for one in inside or () for origin in panels(one)]


def test_time_runs_by_view_by_clock_and_by_distance(recording: Path) -> None:
    def moments(line: str) -> list[Any]:
        return [moment for moment, _ in rows(recording, "/now/forward", "EncodedImage:blob", line)]

    assert moments("view") == list(range(COUNT))
    assert [time.total_seconds() for time in moments("time")] == [2.0 * k for k in range(COUNT)]
    assert moments("distance_cm") == [85 * k for k in range(COUNT)]


def test_scan_in_plan_lies_on_the_walls(tmp_path: Path) -> None:
    """A robot that looks along +y in a corridor along y sees walls at x = 3 ± 1.2 m, wherever it stands."""
    straight = corridor_comparison(count=COUNT, size=24).query_views
    turned = [replace(v, truth=Pose(3.0 - v.truth.y, v.truth.x, math.pi / 2)) for v in straight if v.truth is not None]
    write_recording(tmp_path / "a.rrd", [LocaliseTab(turned)], name="turned")
    clouds = of_views(tmp_path / "a.rrd", "/plan/scan", "Points2D:positions")
    assert len(clouds) == COUNT
    for points in clouds:
        x = np.array(points)[:, 0]
        assert (np.minimum(abs(x - 1.8), abs(x - 4.2)) < 1e-3).sum() > 300
        assert (np.array(points)[:, 1] < 0).all()  # north, shown upwards


def test_scan_beside_the_robot_has_left_on_the_left(tmp_path: Path) -> None:
    ahead_and_left = Scan(np.array([2.0, np.inf, 3.0], np.float32), start=0.0, step=np.pi / 4)
    write_recording(tmp_path / "a.rrd", [LocaliseTab([View(0.0, scan=ahead_and_left)])], name="two beams")
    (points,) = of_views(tmp_path / "a.rrd", "/laser/scan", "Points2D:positions")
    np.testing.assert_allclose(points, [[0, -2], [-3, 0]], atol=1e-6)


def room(door: float | None) -> Scan:
    """A wall 2 m ahead, 8 m wide, with an opening of 1 m whose middle is at y = ``door`` [m], and a room behind it."""
    bearings = np.linspace(-np.pi / 3, np.pi / 3, 481)
    y = 2 * np.tan(bearings)
    through = np.zeros_like(y, np.bool_) if door is None else abs(y - door) < 0.5
    ranges = np.where(through, 5.0, 2.0) / np.cos(bearings)
    return Scan(ranges.astype(np.float32), float(bearings[0]), float(bearings[1] - bearings[0]))


def test_walls_and_doors_of_the_scan_are_drawn_where_they_are(tmp_path: Path) -> None:
    views = [View(0.0, scan=room(None)), View(1.0, scan=room(0.5))]
    write_recording(tmp_path / "a.rrd", [LocaliseTab(views)], name="a door")
    walls = of_views(tmp_path / "a.rrd", "/laser/walls", "LineStrips2D:strips")
    doors = of_views(tmp_path / "a.rrd", "/laser/doors", "LineStrips2D:strips")
    ((whole,),) = [walls[0]]
    np.testing.assert_allclose(sorted(whole), [[-2 * math.sqrt(3), -2], [2 * math.sqrt(3), -2]], atol=0.04)
    assert doors[0] == []
    ((sill,),) = [doors[1]]
    np.testing.assert_allclose(sorted(sill), [[-1, -2], [0, -2]], atol=0.1)


def test_keys_are_matched_where_the_picture_is_that_of_the_believed_place(tmp_path: Path, comparison: Any) -> None:
    """Localised in itself, all keys of a view are words of its own place, and few are those of a place far away."""
    views = corridor_comparison(seed=3, count=COUNT, size=160).reference_views
    sequence = learn(views)
    places = Places.of(sequence, views)
    right = [certain(COUNT, t) for t in range(COUNT)]
    wrong = [certain(COUNT, (t + COUNT // 2) % COUNT) for t in range(COUNT)]
    shares = []
    for name, answers in (("right", right), ("wrong", wrong)):
        tab = LocaliseTab(views, [LocaliserLayer(name, ("x",), places)], {name: {"x": answers}})
        write_recording(tmp_path / f"{name}.rrd", [tab], name=name)
        counts = [
            sum(len(points) for points in of_views(tmp_path / f"{name}.rrd", path, "Points2D:positions"))
            for path in (f"/keys/{name}/forward/matched", f"/keys/{name}/forward/unmatched")
        ]
        assert sum(counts) > 10 * COUNT
        shares.append(counts[0] / sum(counts))
    assert shares[0] == 1.0
    assert shares[1] < 0.5


def test_any_method_is_shown_by_its_name(tmp_path: Path, comparison: Any) -> None:
    """Not only stages: names with strokes and colons are one part of a path, and the last of them is the one shown."""
    steps, still = [certain(COUNT, (5 * t) % COUNT) for t in range(COUNT)], [certain(COUNT, 2, lost=0.7)] * COUNT
    path = tmp_path / "a.rrd"
    answers = {"best/prior": still, "package.module:Class": steps}
    tab = tab_of(comparison.reference_views, comparison.query_views, answers, "a/b")
    write_recording(path, [tab], name="two")
    assert empty_views(tab.layout(), path) == []
    for part, beliefs in ((r"best\/prior", still), (r"package.module\:Class", steps)):
        assert of_views(path, rf"/lost/a\/b/{part}", "Scalars:scalars") == [[belief.lost] for belief in beliefs]
    shown = of_views(path, r"/place/a\/b/forward", "EncodedImage:blob")
    for picture, belief in zip(shown, steps, strict=True):
        assert np.abs(pixels(picture) - comparison.reference_views[belief.best].images["forward"]).mean() < 4


def test_believed_place_and_truth_are_joined_in_the_plan(tmp_path: Path) -> None:
    reference = [View(float(k), truth=Pose(float(k), 2.0, 0.0)) for k in range(5)]
    query = [View(0.0, truth=Pose(1.25, 2.5, 0.0))]
    write_recording(tmp_path / "a.rrd", [tab_of(reference, query, {"x": [certain(5, 3)]})], name="beside")
    ((ring, line),) = of_views(tmp_path / "a.rrd", "/plan/one/believed", "LineStrips2D:strips")
    np.testing.assert_allclose(np.mean(ring[:-1], axis=0), [3.0, -2.0], atol=1e-5)
    np.testing.assert_allclose(line, [[3.0, -2.0], [1.25, -2.5]], atol=1e-6)


def test_the_robot_is_outlined_where_its_scan_puts_it(tmp_path: Path) -> None:
    places = [View(float(k), truth=Pose(float(k), 2.0, math.pi / 2)) for k in range(5)]
    told = PoseBeside(0.5, 0.2, 0.0, np.diag([0.09, 0.01, 0.01]))
    answers = [replace(certain(5, 3), pose=told), certain(5, 3)]
    write_recording(tmp_path / "a.rrd", [tab_of(places, places[:2], {"x": answers})], name="pose")
    beside, nothing = of_views(tmp_path / "a.rrd", "/plan/one/pose", "LineStrips2D:strips")
    assert len(nothing) == 0
    robot, ellipse = (np.array(strip) * (1, -1) for strip in beside)  # north is up: their y runs downwards
    assert robot[:, 1].max() == pytest.approx(2.0 + 0.5 + 0.5)  # it looks north, half a metre before its middle
    assert ellipse[:-1].mean(axis=0) == pytest.approx([3.0 - 0.2, 2.0 + 0.5], abs=1e-5)
    assert np.ptp(ellipse, axis=0) == pytest.approx([4 * 0.1, 4 * 0.3], rel=0.01)


def test_true_place_is_the_nearest_that_looks_the_same_way(tmp_path: Path) -> None:
    out_and_back = [View(0.0, truth=Pose(x, 0.0, 0.0)) for x in (0, 1, 2)]
    out_and_back += [View(0.0, truth=Pose(x, 0.0, math.pi)) for x in (2, 1, 0)]
    query = [View(0.0, truth=Pose(0.9, 0.2, heading)) for heading in (0.1, 3.0)]
    query += [View(0.0), View(0.0, truth=Pose(1.0, 1.6, 0.0))]
    tab = tab_of(out_and_back, query, {Stage.CHAIN: [peaked(6, 1.0, 1.0)] * 4})
    write_recording(tmp_path / "a.rrd", [tab], name="out and back")
    bars = of_views(tmp_path / "a.rrd", "/posterior/one/chain/truth", "BarChart:abscissa")
    assert [bar and bar[0]["buffer"] for bar in bars if bar] == [[1.0], [4.0]]


def test_the_place_where_it_was_last_sure_is_shown_while_it_says_lost(tmp_path: Path) -> None:
    line = [View(float(x), truth=Pose(float(x), 1.0, 0.0)) for x in range(6)]
    behind = 0.7 * np.eye(6)[2]
    answers = [replace(peaked(6, 1.0, 1.0, lost), lost_after=behind * lost) for lost in (0.1, 0.9, 0.2)]
    write_recording(tmp_path / "a.rrd", [tab_of(line, line[:3], {Stage.CHAIN: answers})], name="lost")
    bars = of_views(tmp_path / "a.rrd", "/posterior/one/chain/lost_after", "BarChart:values")
    assert [bar[0]["buffer"] for bar in bars] == [answer.lost_after.tolist() for answer in answers]
    rings = of_views(tmp_path / "a.rrd", "/plan/one/last_sure", "LineStrips2D:strips")
    assert [len(ring) for ring in rings] == [0, 1, 0]
    np.testing.assert_allclose(np.array(rings[1][0])[:-1].mean(axis=0), (2.0, -1.0), atol=0.05)


def test_a_drive_alone_has_a_tab_of_its_own(tmp_path: Path, comparison: Any) -> None:
    tab = LocaliseTab(comparison.query_views)
    write_recording(tmp_path / "drive.rrd", [tab], name="drive")
    assert tab.name == "Drive"
    assert empty_views(tab.layout(), tmp_path / "drive.rrd") == []
    assert {"/now/forward", "/laser/scan", "/plan/drive"} <= entities(tmp_path / "drive.rrd")
    assert not any(path.startswith(("/place", "/lost")) for path in entities(tmp_path / "drive.rrd"))


def test_without_truth_the_plan_is_dead_reckoned(tmp_path: Path) -> None:
    quarter = [View(float(k), distance=1.0 if k else 0.0, turn=math.pi / 2 if k else 0.0) for k in range(5)]
    write_recording(tmp_path / "a.rrd", [LocaliseTab(quarter)], name="square")
    (corners,) = of_views(tmp_path / "a.rrd", "/plan/drive", "LineStrips2D:strips")[-1]
    np.testing.assert_allclose(corners[0], corners[-1], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(np.diff(corners, axis=0), axis=1), 1.0, atol=1e-6)


def test_a_missing_picture_is_taken_away_not_left_standing(tmp_path: Path, comparison: Any) -> None:
    views = [replace(v, images={}, scan=None) if t == 4 else v for t, v in enumerate(comparison.query_views)]
    write_recording(tmp_path / "a.rrd", [LocaliseTab(views)], name="blink")
    pictures = rows(tmp_path / "a.rrd", "/now/forward", "EncodedImage:blob", "view")
    assert [view for view, picture in pictures if picture] == [t for t in range(COUNT) if t != 4]
    for entity in ("/now/forward", "/laser/scan", "/laser/walls"):
        cleared = rows(tmp_path / "a.rrd", entity, "Clear:is_recursive", "view")
        assert [view for view, recursive in cleared if recursive] == [4], entity
    assert of_views(tmp_path / "a.rrd", "/plan/scan", "Points2D:positions")[4] == []


def test_layers_make_one_recording_with_what_a_single_file_holds(tmp_path: Path, comparison: Any) -> None:
    places = Places.along(comparison.reference_views)
    other = {"mine": [certain(COUNT, t) for t in range(COUNT)]}
    answers: dict[str, Answers] = {"one": comparison.beliefs, "other": other}
    layers = beside([LocaliserLayer(name, tuple(methods), places) for name, methods in answers.items()])
    tab = LocaliseTab(comparison.query_views, layers, answers)
    paths = write_layers(tmp_path, tab, name="beside")
    write_recording(tmp_path / "whole.rrd", [tab], name="beside")
    assert [path.name for path in paths] == ["drive.rrd", "one.rrd", "other.rrd"]
    assert empty_views(tab.layout(), tmp_path / "whole.rrd") == []
    whole = {entity for entity in entities(tmp_path / "whole.rrd") if not entity.startswith("/__")}
    parts = [{e for e in entities(path) if not e.startswith("/__")} for path in paths]
    assert whole == set.union(*parts)
    assert not any(parts[i] & parts[j] for i, j in ((0, 1), (0, 2), (1, 2)))
    assert len({identity(path) for path in (*paths, tmp_path / "whole.rrd")}) == 1


def identity(path: Path) -> str:
    from rerun.chunk import RrdReader

    (recording,) = RrdReader(path).recordings()
    return str(recording.recording_id)


def test_a_layer_s_name_must_make_a_file_s(tmp_path: Path, comparison: Any) -> None:
    for name in ("drive", "a/b"):
        tab = tab_of(comparison.reference_views, comparison.query_views, comparison.beliefs, name)
        with pytest.raises(RefseqError, match="cannot name a layer"):
            write_layers(tmp_path, tab, name="x")
    assert list(tmp_path.iterdir()) == []


def test_answers_that_do_not_fit_are_refused(comparison: Any) -> None:
    short: list[Belief] = [certain(COUNT, 0)]
    with pytest.raises(
        RefseqError, match=r"stage 'chain': 1 answers over .*; valid is one answer for each of 12 views"
    ):
        tab_of(comparison.reference_views, comparison.query_views, {Stage.CHAIN: short})
    with pytest.raises(RefseqError, match="answers by no method"):
        LocaliserLayer("none", (), Places.along(comparison.reference_views))


def names_of(panel: Any) -> Any:
    """Names of the views of a layout, nested as its containers are."""
    return panel.name if isinstance(panel, rrb.View) else [names_of(one) for one in panel.contents]


def row_of(comparison: Any, cameras: Sequence[str], *, round_way: bool) -> Any:
    """The top row of the layout for drives with so many cameras, along a strip or all around."""

    def made(views: Sequence[View]) -> list[View]:
        picture = views[0].images["forward"]
        ways = [
            Pose(8 * math.cos(k), 8 * math.sin(k), 0.0) if round_way else Pose(9.0 * k, 0.0, 0.0) for k in range(COUNT)
        ]
        return [replace(v, images=dict.fromkeys(cameras, picture), truth=t) for v, t in zip(views, ways, strict=True)]

    tab = tab_of(made(comparison.reference_views), made(comparison.query_views), comparison.beliefs)
    return names_of(tab.layout())[0]


def test_no_more_than_five_panels_stand_side_by_side(comparison: Any) -> None:
    assert row_of(comparison, ["a", "b"], round_way=False) == [
        "a now", "a believed", "b now", "b believed", "laser: walls, doors",
    ]  # fmt: skip
    *cameras, laser, plan = row_of(comparison, ["a", "b"], round_way=True)
    assert cameras == [["a now", "a believed"], ["b now", "b believed"]]
    assert (laser, plan[:8]) == ("laser: walls, doors", "plan [m]")
    rows, laser, _ = row_of(comparison, list("abcdef"), round_way=True)
    assert [[camera[0] for camera in row] for row in rows] == [["a now", "b now", "c now"], ["d now", "e now", "f now"]]
    assert row_of(comparison, [], round_way=True)[0] == "laser: walls, doors"


def test_the_path_in_the_plan_breaks_between_sequences() -> None:
    poses = [Pose(float(k), 0.0, 0.0) for k in range(3)] + [None] + [Pose(float(k), 9.0, 0.0) for k in range(2)]
    two = Places(poses)
    object.__setattr__(two, "first", np.array([0, 4, 6]))
    assert [line.tolist() for line in two.lines] == [[[0, 0], [1, 0], [2, 0]], [[0, 9], [1, 9]]]
    assert [len(line) for line in Places(poses[:3]).lines] == [3]
