"""``refseq map plan --floor``: a map's paths on the picture of a floor plan, by places that a person marks on it."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.profile import BEST
from refseq.view import LASER
from refseq_bench.scenarios.maps.drawings.plan import draw_plan
from refseq_bench.scenarios.maps.floor_plan import fit_floor, lay_floor
from tests.refseq.rooms import named_maps
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

WIDTH, HEIGHT = 900, 700
SCALE, TURN = 40.0, math.radians(20)
"""Of the similarity that the tests mark places by [pixels a metre], [rad]."""
BAND = 30
"""Width of the way on the floor plan [pixels]."""
BLUE, MUCH = (0xB4, 0x77, 0x1F), 40
"""Colour of the first path (BGR), and a difference from it that is another colour."""


def pixels_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixels (n, 2), from the top left, of points of the map (n, 2) [m]: turned, then enlarged, then counted down."""
    c, s = math.cos(TURN), math.sin(TURN)
    right, up = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    return np.stack([300 + SCALE * right, 650 - SCALE * up], axis=1)


CORNER = np.array([*((float(n), 0, 0) for n in range(10)), *((9, float(n), math.pi / 2) for n in range(1, 11))])
"""Poses of 20 views that go 9 m on and 10 m to the left."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map of two joined paths and one that is not, another of none that is, and pictures, most of which do not do."""
    folder = tmp_path_factory.mktemp("floor")
    drive = corridor_drive(np.random.default_rng(1), count=20, size=96)
    views = [drive, drive[:4], drive[:4]]
    loose = beside(named_maps(["west", "east", "apart"], [learn(one, profile=BEST, sensors=[LASER]) for one in views]))
    west, east, apart = loose.paths
    still = np.tile(CORNER[-1], (4, 1))
    joined = (replace(west, poses=CORNER), replace(east, poses=still), apart)
    replace(loose, paths=joined).save(folder / "whole.refseq")
    loose.save(folder / "loose.refseq")
    plan = np.full((HEIGHT, WIDTH), 255, np.uint8)
    cv2.polylines(plan, [pixels_of(CORNER).round().astype(np.int32)], False, 0, BAND)
    cv2.imwrite(str(folder / "floor.png"), plan)
    cv2.imwrite(str(folder / "floor.jpg"), plan)
    cv2.imwrite(str(folder / "blank.png"), np.full_like(plan, 255))
    cv2.imwrite(str(folder / "deep.png"), plan.astype(np.uint16))
    (folder / "text.png").write_text("no picture")
    return folder


@pytest.fixture
def here(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(folder)
    return folder


def marks(*places: int, digits: int = 9) -> list[str]:
    """Views of the corner by their numbers, marked where they lie."""
    return [
        f"{n}={x:.{digits}f},{y:.{digits}f}" for n, (x, y) in zip(places, pixels_of(CORNER[[*places]]), strict=True)
    ]


def options(at: Sequence[str]) -> list[str]:
    return [word for one in at for word in ("--at", one)]


@pytest.mark.parametrize("seed", range(5))
def test_a_known_similarity_is_found_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, scale, turn = rng.normal(size=(3 + seed, 2)) * 20, rng.uniform(1, 200), rng.uniform(-math.pi, math.pi)
    x, y, origin = *points.T, rng.normal(size=2) * 1000
    right, up = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
    pixels = np.stack([origin[0] + scale * right, origin[1] - scale * up], axis=1)
    found = fit_floor(points, pixels)
    assert found.metres_a_pixel == pytest.approx(1 / scale, rel=1e-9)
    assert found.turn == pytest.approx(turn, abs=1e-9)
    assert found.origin == pytest.approx(origin, rel=1e-9)
    assert found.off == pytest.approx(np.zeros(len(points)), abs=1e-9)
    assert found.pixels(points) == pytest.approx(pixels, rel=1e-9)


def test_three_places_on_a_line_are_enough() -> None:
    on_a_line = CORNER[:9:4, :2]
    found = fit_floor(on_a_line, pixels_of(on_a_line))
    assert found.pixels(CORNER[:, :2]) == pytest.approx(pixels_of(CORNER[:, :2]))


def test_a_mirrored_square_fits_no_turn_at_all() -> None:
    square = np.array([(0.0, 0.0), (10, 0), (10, 10), (0, 10)])
    assert min(fit_floor(square, pixels_of(square * [-1, 1])).off) > 1e6


def test_errors_are_those_of_linear_least_squares() -> None:
    """With c = a + ib the pixels are linear in a, b and the origin: any solver of linear equations finds them."""
    rng = np.random.default_rng(1)
    points = CORNER[[0, 5, 9, 14, 19], :2]
    pixels = pixels_of(points) + rng.normal(size=(5, 2)) * 20
    x, y, one, none = *points.T, np.ones(5), np.zeros(5)
    rows = np.concatenate([np.stack([x, -y, one, none], axis=1), np.stack([-y, -x, none, one], axis=1)])
    (a, b, u, v), *_ = np.linalg.lstsq(rows, pixels.T.ravel(), rcond=None)
    found = fit_floor(points, pixels)
    assert (1 / found.metres_a_pixel, found.turn) == pytest.approx((math.hypot(a, b), math.atan2(b, a)))
    assert found.origin == pytest.approx((u, v))
    left = (rows @ [a, b, u, v]).reshape(2, 5).T - pixels
    assert found.off == pytest.approx(np.hypot(*left.T) / math.hypot(a, b))
    assert max(found.off) > 0.2


def test_it_is_told_how_well_the_map_lies(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "plan", "whole.refseq", "--floor", "floor.jpg", *options(marks(0, 9, 19)))
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.splitlines()[-1].startswith("floor plan: 25 mm a pixel, points off by 0.00 m at most (place ")
    x, y = pixels_of(CORNER[[14]])[0]
    aside = ["west:0={:.0f},{:.0f}".format(*pixels_of(CORNER[:1])[0]), *marks(9, 19), f"west:14={x + SCALE},{y}"]
    answer = refseq("map", "plan", "whole.refseq", "--floor", "floor.png", *options(aside))
    found = json.loads(refseq("map", "plan", "whole.refseq", "--json", "--floor", "floor.png", *options(aside)).out)[
        "floor"
    ]
    worst = found["fit"]["off"][3]
    assert 0.4 < worst == max(found["fit"]["off"]) < 1.0  # of a metre the other marks take a part over
    assert f"points off by {worst:.2f} m at most (place west:14)" in answer.out
    assert [(one["name"], one["place"]) for one in found["marks"]] == [
        ("west:0", 0),
        ("9", 9),
        ("19", 19),
        ("west:14", 14),
    ]
    assert json.loads(refseq("map", "plan", "whole.refseq", "--json").out)["floor"] is None


def test_the_path_is_drawn_on_its_way_in_the_floor_plan(folder: Path, tmp_path: Path) -> None:
    """The floor plan has a wide way where the path runs: in the drawing the path lies along its middle."""
    map_ = Map.load(folder / "whole.refseq")
    draw_plan(tmp_path / "plan.png", map_, lay_floor(folder / "floor.png", marks(0, 9, 19), map_))
    drawn = cv2.imread(str(tmp_path / "plan.png"))
    assert drawn is not None
    path = (np.abs(drawn.astype(int) - BLUE) < MUCH).all(axis=2)
    path[-len(path) // 10 :] = False  # the legend
    faint = (np.abs(drawn.astype(int) - 127) < MUCH / 2).all(axis=2) | path
    way = cv2.morphologyEx(faint.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((25, 25)))
    inside = cv2.distanceTransform(way, cv2.DIST_L2, 5)[path]
    half = inside.max()
    a_pixel = drawn.shape[1] / WIDTH
    assert half == pytest.approx(BAND / 2 * a_pixel, rel=0.15)
    assert np.median(inside) > half - 3 * a_pixel
    assert np.quantile(inside, 0.02) > half / 2
    _, _, width, height = cv2.boundingRect(path.astype(np.uint8))
    reach = np.ptp(pixels_of(CORNER[:, :2]), axis=0) * a_pixel
    assert (width, height) == pytest.approx(reach, rel=0.04)
    # The scale bar, 5 m, is the longest of what is black and thicker than a line.
    thick = cv2.morphologyEx((drawn.max(axis=2) < MUCH).astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5)))
    _, _, boxes, _ = cv2.connectedComponentsWithStats(thick)
    assert boxes[1:, cv2.CC_STAT_WIDTH].max() == pytest.approx(5 * SCALE * a_pixel, rel=0.04)


FLOOR = ["--floor", "floor.png"]
BAD = {
    "no floor": (marks(0), [], "--at {0}: marks a place on the picture of --floor; "),
    "no mark": ([], FLOOR, "--floor floor.png: 0 marked on it; valid are 3 places or more, each by --at "),
    "two marks": (marks(0, 9), FLOOR, "--floor floor.png: 2 marked on it; valid are 3 places or more, "),
    "no place": (["77=1,2", *marks(0, 9)], FLOOR, "--at 77=1,2: place '77' is unknown; valid are 0 to 27, or a path "),
    "no number": (["-1=1,2", *marks(0, 9)], FLOOR, "--at -1=1,2: place '-1' is unknown; "),
    "no path": (["north:1=1,2", *marks(0, 9)], FLOOR, "--at north:1=1,2: place 'north:1': path 'north' is unknown; "),
    "no view": (["west:20=1,2", *marks(0, 9)], FLOOR, "--at west:20=1,2: place 'west:20': path 'west' has 20 views; "),
    "no pixel": (["5=1", *marks(0, 9)], FLOOR, "--at 5=1: is no place and its pixel; valid is PLACE=X,Y, as "),
    "nan": (["5=nan,1", *marks(0, 9)], FLOOR, "--at 5=nan,1: is no place and its pixel; "),
    "left": (["5=-1,2", *marks(0, 9)], FLOOR, "--at 5=-1,2: lies outside of the floor plan; valid are 0 to 899 from "),
    "below": (["5=1,700", *marks(0, 9)], FLOOR, "--at 5=1,700: lies outside of the floor plan; "),
    "far": ([f"5={'9' * 400},1", *marks(0, 9)], FLOOR, "--at 5=inf,1: lies outside of the floor plan; "),
    "a place twice": (
        [*marks(0, 9, digits=0), "west:9=5,5"],
        FLOOR,
        "--at west:9=5,5: is the place of --at {1}; valid is each place once",
    ),
    "a pixel twice": (["0=5,5", "west:9=5,5", "19=1,1"], FLOOR, "--at west:9=5,5: is the pixel of --at 0=5,5; "),
    "one spot": (
        ["20=1,2", "21=300,400", "22=500,10"],
        FLOOR,
        "--at: the 3 places lie within 0.00 m of each other; valid are some that lie 1 m apart and more",
    ),
    "not joined": (["24=1,2", *marks(0, 9)], FLOOR, "--at 24=1,2: is a place of a path that is not joined; valid are "),
    "from the bottom": (
        [f"{name},{HEIGHT - float(y):.0f}" for name, y in (one.split(",") for one in marks(0, 9, 19, digits=0))],
        FLOOR,
        "no scale and turn of the floor plan fits the 3 points, this one least; ",
    ),
    "text": (
        marks(0, 9, 19),
        ["--floor", "text.png"],
        "text.png: an image cannot be decoded; valid are PNG, JPEG, WebP and BMP",
    ),
    "nothing": (marks(0, 9, 19), ["--floor", "none.png"], "none.png: cannot be read: No such file or directory"),
    "blank": (marks(0, 9, 19), ["--floor", "blank.png"], "blank.png: shows nothing; valid is a picture with lines, "),
    "depth": (marks(0, 9, 19), ["--floor", "deep.png"], "deep.png: is of 16 bits, as distances are; valid are "),
}


@pytest.mark.parametrize("case", BAD)
def test_a_mistake_is_told_in_a_line_and_nothing_is_written(refseq: Refseq, here: Path, case: str) -> None:
    at, floor, told = BAD[case]
    answer = refseq("map", "plan", "whole.refseq", "-o", "plan.png", *floor, *options(at))
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert told.format(*at) in answer.err
    assert not (here / "plan.png").exists()


def test_a_map_without_poses_has_no_place_on_a_floor_plan(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "plan", "loose.refseq", "-o", "plan.png", *FLOOR, *options(marks(0, 9, 19)))
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert "no two of its paths are joined with odometry" in answer.err
    assert not (here / "plan.png").exists()


def test_the_floor_plan_is_not_written_over(refseq: Refseq, here: Path) -> None:
    before = (here / "floor.png").read_bytes()
    answer = refseq("map", "plan", "whole.refseq", "-o", "floor.png", *FLOOR, *options(marks(0, 9, 19)))
    assert answer.code == 2
    assert "floor.png: would overwrite floor.png; " in answer.err
    assert (here / "floor.png").read_bytes() == before
