from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.view import View
from refseq.viewer.drawing.incidence import HEIGHT, bands, features_a_place, incidence_picture
from refseq.viewer.map import contents
from refseq.viewer.map.tab import MapTab
from refseq.viewer.recording import write_recording
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import empty_views, entities, rows, values, verified
from tests.support import corridor_comparison

COUNT = 12
pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(scope="module")
def views() -> Any:
    return corridor_comparison(seed=3, count=COUNT, size=48).reference_views


@pytest.fixture(scope="module")
def learnt(views: Any) -> Map:
    return learn(views)


def test_a_map_alone_fills_every_view(learnt: Map, tmp_path: Path) -> None:
    tab = MapTab(learnt)
    write_recording(tmp_path / "map.rrd", [tab], name="map")
    assert empty_views(tab.layout(), tmp_path / "map.rrd") == []
    assert verified(tmp_path / "map.rrd")
    assert not any(entity.startswith("/map/places/frames") for entity in entities(tmp_path / "map.rrd"))


def test_a_map_with_its_drive_shows_frames_and_scans_too(learnt: Map, views: list[View], tmp_path: Path) -> None:
    tab = MapTab(learnt, views)
    write_recording(tmp_path / "map.rrd", [tab], name="map")
    assert empty_views(tab.layout(), tmp_path / "map.rrd") == []
    for entity in ("/map/places/frames/forward", "/map/places/frames/lateral"):
        assert len(values(tmp_path / "map.rrd", entity, "EncodedImage:blob", "view")) == COUNT
    times = rows(tmp_path / "map.rrd", "/map/places/scan", "Points2D:positions", "time")
    assert [time.total_seconds() for time, _ in times] == [view.time for view in views]


def test_features_of_each_place_are_the_matrix_s(learnt: Map, tmp_path: Path) -> None:
    write_recording(tmp_path / "map.rrd", [MapTab(learnt)], name="map")
    columns = learnt.sequence.matrix.columns()
    shown = 0
    for key, block in learnt.sequence.matrix.blocks.items():
        part = key.replace("/", r"\/")
        found = values(tmp_path / "map.rrd", f"/map/places/features/{part}", "Scalars:scalars", "view")
        assert found == [[sum(feature in block for feature in column)] for column in columns]
        shown += int(np.sum(found))
    (bars,) = values(tmp_path / "map.rrd", "/map/places/bars", "BarChart:values")
    assert bars[0]["buffer"] == [len(column) for column in columns]
    assert shown == len(learnt.sequence.matrix.places)


def test_features_of_a_sequence_are_counted_once(learnt: Map, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    monkeypatch.setattr(contents, "features_a_place", lambda matrix: calls.append(1) or features_a_place(matrix))
    write_recording(tmp_path / "map.rrd", [MapTab(learnt)], name="map")
    assert len(calls) == 1


def test_an_atlas_shows_each_of_its_sequences(learnt: Map, views: list[View], tmp_path: Path) -> None:
    atlas = beside(named_maps(["there", "back/again"], [learnt, learn(views[:5])]))
    tab = MapTab(atlas)
    write_recording(tmp_path / "atlas.rrd", [tab], name="atlas")
    assert empty_views(tab.layout(), tmp_path / "atlas.rrd") == []
    assert len(rows(tmp_path / "atlas.rrd", "/map/places/fim/there/now", "LineStrips2D:strips", "view")) == COUNT
    own = rows(tmp_path / "atlas.rrd", r"/map/places/fim/back\/again/now", "LineStrips2D:strips", "view")
    assert [view for view, _ in own] == list(range(COUNT, COUNT + 5))


def a_matrix(K: int, N: int, few: int) -> IncidenceMatrix:
    """Of the first extractor's N features each is seen at one place, in order; the second's are seen everywhere."""
    columns = [{"many": np.flatnonzero(np.arange(N) * K // N == k), "few": np.arange(few)} for k in range(K)]
    return IncidenceMatrix.from_columns(columns, {"many": N, "few": few})


@pytest.mark.parametrize(("K", "N"), [(7, 20), (100, 4000), (2000, 30_000)])
def test_matrix_is_drawn_with_features_down_and_places_right(K: int, N: int) -> None:
    matrix = a_matrix(K, N, 3)
    many, few = bands(matrix)
    picture = incidence_picture(matrix)
    light = picture.astype(int).sum(axis=2)
    upper = light[many.top : many.bottom]
    rows_, columns_ = np.nonzero(upper)
    assert np.corrcoef(rows_, columns_)[0, 1] > 0.97  # a falling diagonal
    assert (light[few.top : few.bottom] == sum(few.colour)).all()
    assert many.top == 0
    assert few.bottom <= HEIGHT
    assert not light[many.bottom : few.top].any()


def test_one_sighting_among_thousands_is_not_lost_in_the_picture() -> None:
    columns = [{"many": np.array([5000] if k == 700 else [], np.intp)} for k in range(1000)]
    picture = incidence_picture(IncidenceMatrix.from_columns(columns, {"many": 10_000}))
    row, column = np.argwhere(picture.sum(axis=2) > 0).mean(axis=0)
    assert abs(row / picture.shape[0] - 0.5) < 0.01
    assert abs(column / picture.shape[1] - 0.7) < 0.01
    assert picture.max() > 50


def test_counts_add_up_by_extractor() -> None:
    counts = features_a_place(a_matrix(10, 50, 4))
    assert counts["many"].tolist() == [5] * 10
    assert counts["few"].tolist() == [4] * 10
