"""The page of joins with the pictures of its views, and recordings that are missing or others."""

import base64
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from refseq.atlas.decision import Decision
from refseq.atlas.found import FoundOverlap
from refseq.atlas.merge import Merged
from refseq.atlas.overlap import Overlap, OverlapSettings
from refseq.atlas.scan_check import ScanCheck
from refseq.logs import RecordingWriter, read_recording
from refseq.map.map import Map, beside
from refseq.planar import Pose
from refseq.scan_matching.panorama import panorama
from refseq.view import View
from refseq_bench.scenarios.maps.joins_page import write_joins_page
from refseq_bench.scenarios.maps.view_pictures import view_pictures
from refseq_bench.scenarios.report.images import FRAME_WIDTH, picture
from tests.refseq.rooms import bits_drive, bits_sequence, cast, rectangle
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

SPACING = 0.85


def record(path: Path, views: list[View]) -> None:
    way = 0.0
    with RecordingWriter(path, {}) as writer:
        for view in views:
            way += view.distance
            writer.write(view, Pose(way, 0.0, 0.0))


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of the two halves of a drive, which share 14 of 44 views, in a folder of their own."""
    folder = tmp_path_factory.mktemp("drives")
    drive = corridor_drive(np.random.default_rng(1), count=44, spacing=SPACING, size=96)
    (folder / "drives").mkdir()
    for name, part in (("west", drive[:30]), ("east", drive[16:])):
        record(folder / "drives" / f"{name}.mcap", part)
    return folder


@pytest.fixture
def here(drives: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder with the maps; of the east every view from the third on was learnt."""
    monkeypatch.chdir(drives)
    if not Path("west.refseq").exists():
        assert refseq("learn", "drives/west.mcap", "--profile", "best", "-o", "west.refseq").code == 0
        assert refseq("learn", "drives/east.mcap", "--profile", "best", "--views", "2:", "-o", "east.refseq").code == 0
    return drives


MERGE = ("map", "merge", "west.refseq", "east.refseq", "-o", "whole.refseq", "--page", "joins.html")


def pixels(uri: str) -> NDArray[np.uint8]:
    data = np.frombuffer(base64.b64decode(uri.removeprefix("data:image/jpeg;base64,")), np.uint8)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)


@pytest.mark.quick_cases("given0")
@pytest.mark.parametrize("given", [["drives"], ["drives/west.mcap", "drives/east.mcap"]])
def test_pictures_of_both_views_stand_side_by_side(
    refseq: Refseq, here: Path, browser: Browser, given: list[str]
) -> None:
    words = [word for one in given for word in ("--recordings", one)]
    answer = refseq(*MERGE, *words)
    assert (answer.code, answer.err) == (0, "")
    tab, errors = browser.new_page(), list[str]()
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.on("console", lambda message: errors.append(message.text))
    tab.goto((here / "joins.html").as_uri())
    drives = {name: read_recording(here / "drives" / f"{name}.mcap").views for name in ("west", "east")}
    captions = tab.locator(".sights figcaption").all_inner_texts()
    shown = [found for text in captions if (found := re.fullmatch(r"(\w+) (\d+), (\S+)", text))]
    images = tab.locator(".sights img")
    # Two ends and the middle at least, of either path, by two cameras.
    assert images.count() == len(shown) >= 3 * 2 * 2
    for number, (name, view, camera) in enumerate(found.groups() for found in shown):
        its = drives[name][int(view) + (2 if name == "east" else 0)]
        assert images.nth(number).get_attribute("src") == picture(its.images[camera])
    # View 18 of the west is the first that was learnt of the east.
    for mine, other in zip(shown[::2], shown[1::2], strict=True):
        assert (mine[1], other[1]) == ("west", "east")
        assert mine[3] == other[3]
        assert abs(int(mine[2]) - int(other[2]) - 18) <= 1
    assert tab.locator(".scans svg").count() == tab.locator(".spot").count()
    assert {"A", "B", "C"} <= set(tab.locator(".claim text").all_text_contents())
    # Nothing sticks out on a telephone, nor where pictures are large.
    for width in (1280, 390):
        tab.set_viewport_size({"width": width, "height": 800})
        assert tab.evaluate("document.documentElement.scrollWidth") == width
        small = images.first.bounding_box()
        tab.keyboard.press("z")
        large = images.first.bounding_box()
        assert tab.evaluate("document.documentElement.scrollWidth") == width
        assert small is not None
        assert large is not None
        assert large["width"] >= small["width"] >= 100
        tab.keyboard.press("z")
    tab.close()
    assert errors == []


def test_a_recording_that_is_missing_is_one_line_and_the_page_goes_on(refseq: Refseq, here: Path) -> None:
    answer = refseq(*MERGE, "--recordings", "drives/west.mcap")
    assert answer.code == 0
    assert answer.err.splitlines() == [
        "note: no pictures of east: its recording east.mcap is not among drives/west.mcap"
    ]
    page = (here / "joins.html").read_text()
    assert page.count("data:image/jpeg") == page.count('<p class="none">no picture</p>') > 0


def test_another_drive_of_the_same_name_has_no_pictures_of_the_map(refseq: Refseq, here: Path) -> None:
    (here / "others").mkdir()
    record(here / "others" / "west.mcap", corridor_drive(np.random.default_rng(2), count=29, size=96))
    (here / "others" / "east.mcap").write_text("no recording")
    answer = refseq(*MERGE, "--recordings", "others")
    assert answer.code == 0
    west, east = answer.err.splitlines()
    assert west == (
        "note: no pictures of west: others/west.mcap: has no view at 58.000000 s, as view 29 of the map's 30 is; valid "
        "is the recording that the map was learnt from"
    )
    assert east.startswith("note: no pictures of east: others/east.mcap: ")
    assert "data:image" not in (here / "joins.html").read_text()


def test_a_map_that_does_not_tell_of_its_recording_has_no_pictures(
    here: Path, caplog: pytest.LogCaptureFixture
) -> None:
    west = Map.load(here / "west.refseq")
    assert view_pictures([west.noted({"source": "other.mcap"})], [here / "drives"], {"west": [0]}) == {}
    assert "its recording other.mcap is not among" in caplog.messages[-1]
    assert set(view_pictures([west], [here / "drives"], {"west": [3, 0], "east": [1]})) == {("west", 0), ("west", 3)}
    unnoted = Map.load(here / "west.refseq")
    for sequence in unnoted.sequences:
        object.__setattr__(sequence, "metadata", {})
    assert view_pictures([unnoted], [here / "drives"], {"west": [0]}) == {}
    assert "does not tell which recording" in caplog.messages[-1]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ("--page", "joins.html", "--recordings", "nowhere"),
            "nowhere: is not there; valid is a recording, or a folder",
        ),
        (
            ("--recordings", "drives"),
            "--recordings has pictures for the page of --page; valid is to ask for that as well",
        ),
    ],
)
def test_wrong_words_about_recordings(refseq: Refseq, here: Path, words: tuple[str, ...], told: str) -> None:
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "-o", "none.refseq", *words)
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert told in answer.err
    assert not (here / "none.refseq").exists()


def test_a_picture_on_the_page_is_that_of_the_view(here: Path) -> None:
    view = read_recording(here / "drives" / "west.mcap").views[4]
    found = view_pictures([Map.load(here / "west.refseq")], [here / "drives"], {"west": [4]})[("west", 4)]
    assert set(found) == set(view.images)
    for camera, uri in found.items():
        whole = cv2.resize(view.images[camera], (FRAME_WIDTH, FRAME_WIDTH * 3 // 4), interpolation=cv2.INTER_AREA)
        assert np.abs(pixels(uri).astype(float) - whole).mean() < 3


def test_scans_are_drawn_by_the_scale_of_the_odometer_that_they_lie_by(tmp_path: Path) -> None:
    """One path's odometer tells a tenth more for each metre: of a window of 5 m no shift lays all scans well."""
    count = 25
    posts = [(x, side, x, side / 2) for x in np.arange(12.0, 58.0, 2.0).tolist() for side in (-1.2, 1.2)]
    walls = [*rectangle(0, -1.2, 60, 1.2), *posts]
    scans = np.stack([panorama(cast(walls, Pose(10.0 + x, 0.0, 0.0))) for x in range(count)])
    views = bits_drive({"camera": np.eye(count, dtype=np.bool_)})
    tracks = [np.column_stack([scale * np.arange(count), np.zeros((count, 2))]) for scale in (1.0, 1.1)]
    both = beside(
        [
            Map.of(replace(bits_sequence(views), odometry=track), name, scans=scans)
            for name, track in zip(("true", "longer"), tracks, strict=True)
        ]
    )
    pairs = np.column_stack([np.arange(count)] * 2)
    overlap = Overlap(pairs, (24.0, 26.4), {"camera": 3.0}, evidence=75.0)
    found = ScanCheck(both, tracks, OverlapSettings()).checked(FoundOverlap(0, 1, pairs, overlap))
    ends = int(found.views[0, 0]), int(found.views[-1, 0])
    decision = Decision("true", "longer", ends, ends, found.overlap.lengths, joined=True, why="")
    write_joins_page(tmp_path / "joins.html", Merged(both, (decision,), (found,)), "Joins")
    shares = re.findall(r"([\d.]+)% of the beams", (tmp_path / "joins.html").read_text())
    assert len(shares) >= 3
    assert min(map(float, shares)) >= 99.0, shares
