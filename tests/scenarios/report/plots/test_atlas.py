"""Plots of several drives, read back from their SVG: what is told, what is drawn, and where."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from refseq_bench.scenarios.report.plots.atlas import ASIDE as APART
from refseq_bench.scenarios.report.plots.atlas import draw_passing, joined_plan, shares, which_drive
from refseq_bench.scenarios.report.plots.belief import FINEST, belief_heatmaps, coarser
from refseq_bench.scenarios.report.plots.plan import QUERY_WALLS
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.report.sections.atlas import atlas_part
from refseq_bench.scenarios.scoring.atlas import passing
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import figures
from refseq_bench.scenarios.scoring.path_geometry import WIDE, Tolerance, path_of
from refseq_bench.scenarios.tables import NONE
from tests.scenarios.forks import (
    AHEAD,
    COUNT,
    DRIVES,
    FALSE,
    PARTING,
    RIGHTLY,
    SHARED,
    compared,
    known,
    merging,
    split,
    views,
)

FALSELY = {**RIGHTLY, **{21 + k: k for k in range(12, 17)}}
WALL = [np.array([[-3.0, -2.0], [25.0, -2.0]])]


def texts(plot: Plot) -> list[str]:
    drawn = [text.strip() for text in re.findall(r"<text[^>]*>([^<]+)</text>", plot.svg)]
    return [*drawn, *(entry.label for entry in plot.legend)]


def marks(svg: str) -> int:
    """How many markers are drawn, those in the legend among them."""
    return len(re.findall(r"<use xlink:href=", svg))


@pytest.fixture(scope="module")
def run() -> Comparison:
    beliefs = {"best/chain": known(*range(11), *range(32, 40)), "vlad": [split({0: 0.5, 21: 0.25, 42: 0.25}, 0.2)] * 19}
    return compared(PARTING, beliefs, {"best/chain": merging(FALSELY, SHARED, FALSE, replace(SHARED, joined=False))})


@given(st.lists(st.tuples(st.integers(0, COUNT - 1), st.integers(0, COUNT - 1), st.floats(0, 1)), min_size=1))
def test_shares_and_what_is_lost_make_one(drawn: list[tuple[int, int, float]]) -> None:
    beliefs = [split({one: 0.5}, lost) if one == two else split({one: 0.6, two: 0.4}, lost) for one, two, lost in drawn]
    path = path_of(compared([], {}))
    found = shares(beliefs, path)
    assert found.shape == (3, len(drawn))
    assert found.sum(axis=0) + [lost for *_, lost in drawn] == pytest.approx(np.ones(len(drawn)))
    for (one, two, lost), column in zip(drawn, found.T, strict=True):
        expected = np.zeros(3)
        for place, share in ((one, 1.0),) if one == two else ((one, 0.6), (two, 0.4)):
            expected[0 if place < 21 else 1 if place < 42 else 2] += share * (1 - lost)
        assert column == pytest.approx(expected)


def test_the_plan_tells_how_many_places_each_drive_keeps_and_what_was_joined_falsely(run: Comparison) -> None:
    told = texts(joined_plan(run, run.mergings["best/chain"], WIDE, None))
    assert [text for text in told if "(" in text] == [
        "ahead (21 of 21)",
        "aside (5 of 21)",
        "elsewhere (5 of 5)",
        "joined with another place (5)",
    ]
    right = texts(joined_plan(run, merging(RIGHTLY), WIDE, None))
    assert not any("joined" in text for text in right)
    narrow = texts(joined_plan(run, merging({21 + k: k + 1 for k in range(11)}), Tolerance(0.5), WALL))
    assert {"joined with another place (11)", QUERY_WALLS} <= set(narrow)


def test_every_view_has_its_mark_in_the_plan_held_or_not(run: Comparison) -> None:
    drawn = [marks(joined_plan(run, merging(held), WIDE, None).svg) for held in ({}, RIGHTLY, FALSELY)]
    assert len(set(drawn)) == 1
    for unknown in (25, 35):  # of which the one was taken out
        reference = [*run.reference_views]
        reference[unknown] = replace(reference[unknown], truth=None)
        less = replace(run, reference_views=reference)
        assert marks(joined_plan(less, merging(RIGHTLY), WIDE, None).svg) == drawn[0] - 1


def test_drives_are_drawn_beside_each_other_to_the_right_of_their_ways() -> None:
    """The second stands out by what it is drawn further to the right than the first: down, where both go along x."""
    drives = {"a": AHEAD[:5], "b": AHEAD[:5]}
    svg = joined_plan(compared(AHEAD[:5], {}, drives=drives), merging(drives=drives), WIDE, None).svg
    points = [(float(x), float(y)) for x, y in re.findall(r'<use xlink:href="[^"]+" x="([\d.]+)" y="([\d.]+)"', svg)]
    rows = [y for y in dict.fromkeys(y for _, y in points) if sum(one == y for _, one in points) >= 5]
    first, second = rows[-2:]
    along = sorted(x for x, y in points if y == first)
    assert second > first
    assert (second - first) / (along[-1] - along[0]) == pytest.approx(APART / 4.0, rel=1e-3)


def test_views_without_a_pose_are_left_out_and_nothing_else() -> None:
    drives = {"a": [*AHEAD[:5], *views(None)], "b": views(None, (1.0, 0.0, 0.0))}
    comparison = compared([*AHEAD[:3], *views(None)], {"m": known(0, 1, 2, 5, count=8)}, drives=drives)
    told = texts(joined_plan(comparison, merging({6: 5, 7: 1}, drives=drives), WIDE, None))
    assert {"a (6 of 6)", "b (0 of 2)", "joined with another place (1)"} <= set(told)
    assert "nan" not in which_drive(comparison, ["m"], WIDE).svg


def test_each_method_has_a_panel_and_each_drive_a_row(run: Comparison) -> None:
    told = texts(which_drive(run, ["best/chain", "vlad"], WIDE))
    assert {"best/chain", "vlad", "truly there", "P(sequence) = 0.1"} <= set(told)
    for name in (*DRIVES, "lost"):
        assert told.count(name) == 2  # a row in each panel
    assert texts(which_drive(run, ["vlad"], WIDE)).count("ahead") == 1


def bars(by: np.ndarray) -> list[list[tuple[int, int]]]:
    """For each row the views that its bars span: from, to (not among them)."""
    axes = Figure().add_subplot()
    draw_passing(axes, by)
    rows = [row for row in axes.collections if isinstance(row, PolyCollection)]
    ends = [[np.add((box.x0, box.x1), 0.5) for box in (path.get_extents() for path in row.get_paths())] for row in rows]
    return [[(int(low), int(high)) for low, high in row] for row in ends]


def test_the_truth_is_a_bar_in_the_row_of_each_drive_that_passes(run: Comparison) -> None:
    """Views 0 to 10 are passed by two; the first drive goes straight on there, the second as the query does."""
    path = path_of(run)
    assert bars(passing(path, path.near(run.query_views, WIDE))) == [[(0, 11)], [(0, 19)], [], []]
    assert bars(np.array([[True], [False], [True], [True]])) == [[(0, 1), (2, 4)], [(1, 2)]]


@pytest.mark.parametrize("names", [["lost", "b"], ["", "_hidden"], ["<a> & b", "$x$"], [str(n) for n in range(33)]])
def test_drives_may_have_any_names_and_be_many(names: list[str]) -> None:
    drives = dict.fromkeys(names, AHEAD[:3])
    comparison = compared(AHEAD[:3], {"m": known(0, 1, 2, count=3 * len(names))}, drives=drives)
    assert which_drive(comparison, ["m"], WIDE).svg.startswith("<svg")
    assert joined_plan(comparison, merging(drives=drives), WIDE, None).svg.startswith("<svg")


def test_places_are_named_by_their_drives_where_there_are_several(run: Comparison) -> None:
    told = texts(belief_heatmaps(run, path_of(run), WIDE))
    assert [told.count(name) for name in DRIVES] == [1, 1, 1]
    assert "reference place" not in told
    alone = compared(AHEAD, {"m": known(*range(21), count=21)}, drives={"ahead": AHEAD})
    told = texts(belief_heatmaps(alone, path_of(alone), WIDE))
    assert "reference place" in told
    assert "ahead" not in told


@given(st.integers(1, 3 * FINEST[0]), st.integers(1, 2 * FINEST[1]), st.integers(0, 2**32 - 1))
def test_no_peak_is_lost_in_a_coarser_picture(places: int, views_asked: int, seed: int) -> None:
    shares_there = np.random.default_rng(seed).random((places, views_asked)) ** 8
    found = coarser(shares_there)
    each = [math.ceil(count / finest) for count, finest in zip(shares_there.shape, FINEST, strict=True)]
    assert found.shape == tuple(math.ceil(count / n) for count, n in zip(shares_there.shape, each, strict=True))
    assert all(count <= finest for count, finest in zip(found.shape, FINEST, strict=True))
    for row, column in [(0, 0), (places // 2, views_asked // 2), (places - 1, views_asked - 1)]:
        top, left = row // each[0] * each[0], column // each[1] * each[1]
        cell = shares_there[top : top + each[0], left : left + each[1]]
        assert found[row // each[0], column // each[1]] == cell.max()


def test_a_picture_that_is_coarser_says_so(run: Comparison) -> None:
    many = {"a": views(*((float(x), 0.0, 0.0) for x in range(FINEST[0] + 1)))}
    count = FINEST[0] + 1
    large = compared(AHEAD[:3], {"m": known(0, 1, 2, count=count)}, drives=many)
    assert belief_heatmaps(large, path_of(large), WIDE).note == "Each cell is the highest of 2 places."
    assert belief_heatmaps(run, path_of(run), WIDE).note == ""


# --- the part of a page ---


def test_a_page_tells_of_the_joins_of_who_is_judged(run: Comparison) -> None:
    shown = atlas_part(run, figures([run]), ["best/chain", "vlad"], "best/chain", WIDE, None)
    assert shown is not None
    assert [(row.joined, row.one, row.other, row.why) for row in shown.joins] == [
        (True, "ahead 0-10", "aside 0-10", "they are alike"),
        (True, "ahead 12-16", "aside 12-16", "they look alike"),
        (False, "ahead 0-10", "aside 0-10", "they are alike"),
    ]
    assert shown.plan is not None
    assert "joined with another place (5)" in texts(shown.plan)
    ours, other = shown.table.rows
    assert (ours.label, ours.cells[:3]) == ("best/chain", ("0.00 m", "n/a / 0.000 / 1.000", "0"))
    assert ours.cells[3] == "2 (1)"
    assert ours.cells[6:] == ("31 of 47", "0", "4 of 5")
    assert (other.label, other.cells[:3]) == ("vlad", ("never (1 of 1)", "n/a / 0.250 / 0.250", "0"))
    assert other.cells[3:] == (NONE,) * 6


def test_who_has_no_atlas_shows_no_joins_and_one_drive_shows_nothing(run: Comparison) -> None:
    shown = atlas_part(run, figures([run]), ["vlad"], "vlad", WIDE, None)
    assert shown is not None
    assert (shown.plan, shown.joins) == (None, ())
    alone = compared(AHEAD, {"m": known(*range(21), count=21)}, drives={"ahead": AHEAD})
    assert atlas_part(alone, figures([alone]), ["m"], "m", WIDE, None) is None
    assert math.isnan(figures([alone])[0].wide.worst_false_fix)
