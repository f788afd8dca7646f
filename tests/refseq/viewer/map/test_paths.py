"""The tab Map, of several paths: what the atlas and the localiser said is what the recording holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.atlas.decision import Decision
from refseq.atlas.merge import Merged, merge_maps
from refseq.atlas.similarity import view_similarity
from refseq.belief import Stage
from refseq.errors import RefseqError
from refseq.map.localiser import localise
from refseq.map.map import Map, beside
from refseq.map.profile import BEST
from refseq.map.reduction import reduced
from refseq.viewer.drawing.pictures import inferno
from refseq.viewer.map.similarity import Mosaic, shared_stretches
from refseq.viewer.map.sizes import sizes_table
from refseq.viewer.map.tab import MapTab
from refseq.viewer.recording import write_recording
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import empty_views, entities, picture, rows, values, verified
from tests.refseq.walks import Town
from tests.support import certain

pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take
TOWN = Town(density=8.0)
METHODS = (Stage.UNIFORM, Stage.CHAIN)


@pytest.fixture(scope="module")
def learnt() -> dict[str, Map]:
    """Two walks that share a corridor, and one of its own."""
    ways = {"a": [("A", 0, 15), ("B", 0, 20)], "b": [("C", 0, 10), ("B", 0, 20), ("D", 0, 10)], "c": [("E", 0, 15)]}
    return {name: Map.of(TOWN.learnt(legs, n, BEST), name) for n, (name, legs) in enumerate(ways.items())}


@pytest.fixture(scope="module")
def merged(learnt: dict[str, Map]) -> Merged:
    return merge_maps(named_maps(list(learnt), list(learnt.values())))


@pytest.fixture(scope="module")
def tab(merged: Merged, learnt: dict[str, Map]) -> MapTab:
    drive = TOWN.views([("C", 2, 10), ("B", 0, 20), ("D", 0, 5)], 9)
    refused = Decision("a", "c", (1, 4), (2, 5), (3.0, 3.0), joined=False, why="only 3.0 m long")
    outline = [np.array([(0.0, 0.0), (10.0, 5.0)])]
    answers = {str(stage): beliefs for stage, beliefs in localise(merged.map, drive, stages=METHODS).items()}
    return MapTab(merged.map, (), drive, answers, (*merged.decisions, refused), learnt, outline)


@pytest.fixture(scope="module")
def recording(tab: MapTab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("atlas") / "atlas.rrd"
    write_recording(path, [tab], name="town")
    return path


def test_every_panel_has_data_and_rerun_finds_nothing_wrong(tab: MapTab, recording: Path) -> None:
    assert verified(recording)
    assert empty_views(tab.layout(), recording) == []
    assert all(entity.startswith(("/map/", "/__")) for entity in entities(recording))


def test_an_atlas_alone_is_shown_without_drive_pictures_or_poses(merged: Merged, tmp_path: Path) -> None:
    nowhere = tuple(replace(one, poses=(None,) * len(one)) for one in merged.map.sequences)
    tab = MapTab(replace(merged.map, sequences=nowhere))
    write_recording(tmp_path / "a.rrd", [tab], name="nowhere")
    assert empty_views(tab.layout(), tmp_path / "a.rrd") == []
    assert not any("plan" in entity for entity in entities(tmp_path / "a.rrd"))


def test_p_of_each_sequence_is_what_the_localiser_gave(tab: MapTab, recording: Path) -> None:
    for method, beliefs in tab.answers.items():
        for number, name in enumerate(tab.map.names):
            told = rows(recording, f"/map/paths/share/{method}/of/{name}", "Scalars:scalars", "view")
            expected = [(1 - b.lost) * tab.map.sequence_probabilities(b)[number] for b in beliefs]
            assert [view for view, _ in told] == list(range(len(beliefs)))
            assert [value for _, (value,) in told] == expected
        lost = values(recording, f"/map/paths/share/{method}/lost", "Scalars:scalars", "view")
        assert [value for (value,) in lost] == [belief.lost for belief in beliefs]


def test_three_time_lines(tab: MapTab, recording: Path) -> None:
    entity, views = "/map/paths/share/chain/lost", list(tab.drive)
    times = [moment.total_seconds() for moment, _ in rows(recording, entity, "Scalars:scalars", "time")]
    assert times == [view.time for view in views]
    gone = np.cumsum([0, *(view.distance for view in views[1:])])
    assert [moment for moment, _ in rows(recording, entity, "Scalars:scalars", "distance_cm")] == (100 * gone).tolist()


def test_what_is_joined_is_what_merging_joined(merged: Merged, tab: MapTab, recording: Path) -> None:
    (join,) = [decision for decision in merged.decisions if decision.joined]
    (shared,) = shared_stretches(merged.map)
    assert (shared.one, shared.other) == (0, 1)
    np.testing.assert_allclose(shared.views[[0, -1]].T, [join.first, join.second], atol=1)
    for own, other in shared.views:
        assert merged.map.numbered(merged.map.paths[0])[own] == merged.map.numbered(merged.map.paths[1])[other]
    lines = values(recording, "/map/paths/alike/joined", "LineStrips2D:strips")[0]
    assert len(lines) == 2
    (a, b), (c, d) = np.array(lines)
    size = sum(map(len, merged.map.paths))
    first = len(merged.map.paths[0])
    np.testing.assert_allclose(a, [join.first[0] + 0.5, size - first - join.second[0] - 0.5], atol=1)
    np.testing.assert_allclose(b, [join.first[1] + 0.5, size - first - join.second[1] - 0.5], atol=1)
    np.testing.assert_allclose(c, [first + join.second[0] + 0.5, size - join.first[0] - 0.5], atol=1)
    np.testing.assert_allclose(d, [first + join.second[1] + 0.5, size - join.first[1] - 0.5], atol=1)
    why = values(recording, "/map/paths/alike/refused", "LineStrips2D:labels")[0]
    assert set(why) == {decision.why for decision in tab.decisions if not decision.joined}


def test_the_square_holds_both_similarity_matrices(learnt: dict[str, Map], tmp_path: Path) -> None:
    a, c = learnt["a"], learnt["c"]
    write_recording(tmp_path / "a.rrd", [MapTab(beside(named_maps(["a", "c"], [a, c])))], name="two")
    drawn = picture(tmp_path / "a.rrd", "/map/paths/alike/picture")
    brightness = (drawn[:, :, None] == inferno()).all(axis=3).argmax(axis=2)[::-1]  # place upwards
    expected = [(slice(0, len(a)), slice(len(a), None), view_similarity(a.sequence, c.sequence))]
    expected += [(slice(len(a), None), slice(0, len(a)), view_similarity(c.sequence, a.sequence))]
    for views, places, alike in expected:
        np.testing.assert_array_equal(brightness[places, views], np.round(255 * np.sqrt(alike)).T)


def test_a_large_square_is_drawn_with_its_brightest_views(merged: Merged, monkeypatch: pytest.MonkeyPatch) -> None:
    """By brute force, view by view; the last pixel stands for fewer views."""
    size = Mosaic(merged.map).size
    fine = Mosaic(merged.map).grey()[::-1]
    monkeypatch.setattr("refseq.viewer.map.similarity.MOST_PIXELS", size // 4 + 1)
    small = Mosaic(merged.map)
    assert size % small.unit > 0
    expected = np.zeros((small.side, small.side), np.uint8)
    for place in range(size):
        for view in range(size):
            at = place // small.unit, view // small.unit
            expected[at] = max(expected[at], fine[place, view])
    np.testing.assert_array_equal(small.grey()[::-1], expected)
    first = len(merged.map.paths[0])
    ((x, y),) = small.at(0, 1, np.array([[3, 4]]))
    assert (int(x), int(small.side - y)) == (3 // small.unit, (first + 4) // small.unit)


def test_colours_tell_who_holds_each_place(tab: MapTab, recording: Path) -> None:
    for row, path in enumerate(tab.map.paths):
        colours = values(recording, f"/map/paths/strips/views/{row}", "Points2D:colors")[0]
        for view, other in enumerate(path.sequences.tolist()):
            assert (colours[view] == colours[0]) == (other == path.sequences[0])
    dots = sum(len(values(recording, f"/map/paths/plan/places/{n}", "Points2D:positions")[0]) for n in range(3))
    assert dots == len(tab.map)


def test_sizes_tell_what_was_taken_out(tab: MapTab, learnt: dict[str, Map]) -> None:
    atlas = tab.map
    table = sizes_table(atlas, learnt)
    total = sum(map(len, learnt.values()))
    assert f"| **all** | {total} | {len(atlas)} | {total - len(atlas)} | |" in table
    features = sum(one.sequence.matrix.N for one in learnt.values()), sum(one.matrix.N for one in atlas.sequences)
    assert f"- {features[0]:,} → {features[1]:,} features" in table
    links = len(atlas.links)
    assert f"- {links} link{'s' if links > 1 else ''} from one path to another" in table
    assert " → " not in sizes_table(atlas, {})


def test_a_reduced_map_shows_what_is_gone(learnt: dict[str, Map], tmp_path: Path) -> None:
    kept = np.array([0, 1, 2, 7, 8, 20, 30])
    small = reduced(learnt["a"].sequence, kept)
    tab = MapTab(beside(named_maps(["a"], [small])), before={"a": learnt["a"]})
    write_recording(tmp_path / "a.rrd", [tab], name="reduced")
    gone = values(tmp_path / "a.rrd", "/map/paths/strips/gone/0", "Points2D:positions")[0]
    np.testing.assert_allclose([x for x, _ in gone], np.delete(learnt["a"].sequence.along, kept), rtol=1e-6)
    assert f"| a | {len(learnt['a'])} | 7 | {len(learnt['a']) - 7} | – |" in sizes_table(tab.map, tab.before)
    assert empty_views(tab.layout(), tmp_path / "a.rrd") == []


def test_answers_have_to_fit(merged: Merged, tmp_path: Path) -> None:
    with pytest.raises(RefseqError, match=r"method 'mine': answers over 3 places; valid is over the \d+ places"):
        MapTab(merged.map, answers={"mine": [certain(3, 1)]})
    drive = TOWN.views([("C", 2, 5)], 9)
    for count in (2, 4):
        short = MapTab(merged.map, (), drive, {"mine": [certain(len(merged.map), 1)] * count})
        with pytest.raises(RefseqError, match=f"method 'mine': {count} answers; valid is one a view, 3"):
            write_recording(tmp_path / "a.rrd", [short], name="short")
    assert list(tmp_path.iterdir()) == []
