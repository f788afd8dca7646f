import base64
import io
import json
import re
from collections.abc import Sequence
from dataclasses import asdict, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure

from refseq.belief import Stage, Timings
from refseq.fault import DeclaredFault, FaultKind
from refseq.planar import Pose
from refseq.view import View
from refseq_bench import scenarios
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.names import METHODS
from refseq_bench.scenarios.report.contact_sheet import CaptionedImage, contact_sheet
from refseq_bench.scenarios.report.document import details, facts, write_report
from refseq_bench.scenarios.report.plots.belief import belief_heatmaps
from refseq_bench.scenarios.report.plots.confidence import confidence
from refseq_bench.scenarios.report.plots.errors import errors_along_path
from refseq_bench.scenarios.report.plots.plan import QUERY_WALLS, drive_plan
from refseq_bench.scenarios.report.plots.progress import answers_over_odometer
from refseq_bench.scenarios.report.plots.retrieval import draw_retrieval
from refseq_bench.scenarios.report.plots.style import INK, method_styles
from refseq_bench.scenarios.report.plots.sweep import draw_shares
from refseq_bench.scenarios.report.plots.truth import draw_truth
from refseq_bench.scenarios.report.sections.experiment import SectionSettings, section
from refseq_bench.scenarios.report.sections.headline import Headline, headline
from refseq_bench.scenarios.report.sections.tables import further_row
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.fault_spans import fault_spans
from refseq_bench.scenarios.scoring.figures import figures, success_over_seeds
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, ReferencePath, path_of
from refseq_bench.scenarios.scoring.score import pool, score
from refseq_bench.scenarios.scoring.truth import unscored_reason
from refseq_bench.sim.drives.operator import STYLES
from tests.support import CORRIDOR, certain, corridor_comparison

COUNT = 30
VOID = {"meta", "img", "br"}
SAME_PLACE = re.compile(r"(\w+), (\w+), query view (\d+), reference place (\d+)")


class Page(HTMLParser):
    """Rows of the tables, sources of the pictures, and everything that a browser would fetch."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.pictures: list[tuple[str, str]] = []
        self.fetched: list[str] = []
        self.scans = 0
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {key: value or "" for key, value in attrs}
        self.fetched += [v for k, v in values.items() if k in ("src", "href", "xlink:href", "srcset", "data")]
        if tag == "img":
            self.pictures.append((values["alt"], values["src"]))
        self.scans += values.get("aria-label", "").startswith("scan")
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data

    def row(self, label: str) -> list[str]:
        return next(row for row in self.rows if row[0] == label)


@pytest.fixture(scope="module")
def runs() -> list[Comparison]:
    return [corridor_comparison(seed, count=COUNT, size=48) for seed in range(3)]


@pytest.fixture(scope="module")
def text(runs: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(path, runs, title="Three seeds", outline=CORRIDOR)
    return path.read_text()


def chain_alone(run: Comparison) -> Comparison:
    """A run judged at its last stage only, for pages that draw what does not depend on how many methods there are."""
    return replace(run, beliefs={Stage.CHAIN: run.beliefs[Stage.CHAIN]})


def written(tmp_path: Path, *comparisons: Comparison, title: str = "a") -> str:
    write_report(tmp_path / "r.html", comparisons, title=title, outline=None)
    return (tmp_path / "r.html").read_text()


def test_page_is_whole_and_needs_nothing_beside_it(text: str) -> None:
    page = Page(text)
    assert page.open == []
    assert all(source.startswith(("data:", "#")) for source in page.fetched)
    assert not re.search(r"@import|url\((?!#)", text)
    assert text.count("<script") == 1  # that it is ours: test_style.py
    assert not re.search(r"<link|<iframe|<object", text)
    assert INK not in text


def test_table_has_the_scorer_s_figures(text: str, runs: list[Comparison]) -> None:
    page = Page(text)
    for stage in Stage:
        wide = pool([score(run, stage) for run in runs])
        narrow = pool([score(run, stage, NARROW) for run in runs])
        row = page.row(stage.label)
        low, high = (100 * bound for bound in wide.success.interval)
        assert row[1] == f"{3 * COUNT} / {narrow.success.trials}"
        assert row[2] == f"{100 * wide.success.value:.1f} % [{low:.0f}, {high:.0f}]"
        assert row[3].startswith(f"{100 * narrow.success.value:.1f} % [")
        ends = [success_over_seeds([score(run, stage, near) for run in runs]) for near in (WIDE, NARROW)]
        assert row[4] == " / ".join(f"[{100 * end[0]:.1f}, {100 * end[1]:.1f}]" for end in ends if end)
        assert row[5] == str(wide.failures)
        assert row[6] == f"{np.nanmedian(np.abs(wide.errors)):.2f} m"
        assert row[7] == f"{np.nanquantile(np.abs(wide.errors), 0.95):.2f} m"


def test_what_was_driven_is_said(text: str) -> None:
    page = Page(text)
    assert page.row("light") == ["light", "16:00", "18:00"]
    assert page.row("seed") == ["seed", "0, 1, 2", "1000, 1001, 1002"]
    assert page.row("versions.mujoco") == ["versions.mujoco", "4.0.0"]


def test_frames_show_matching_places_of_both_drives(text: str, runs: list[Comparison]) -> None:
    matched = [(SAME_PLACE.match(alt), source) for alt, source in Page(text).pictures]
    same = [(found.groups(), source) for found, source in matched if found]
    assert len(same) == 4 * 2 * 2
    for (camera, which, t, k), source in same:
        views = runs[0].reference_views if which == "reference" else runs[0].query_views
        original = views[int(k if which == "reference" else t)].images[camera]
        data = np.frombuffer(base64.b64decode(source.split(",")[1]), np.uint8)
        shown = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
        assert shown.shape == (240, 320)
        assert abs(shown.mean() - original.mean()) < 3
        truth = runs[0].query_views[int(t)].truth
        assert ReferencePath(runs[0].reference_views).nearest(truth) == int(k)


def test_same_input_gives_the_same_bytes(text: str, runs: list[Comparison], tmp_path: Path) -> None:
    write_report(tmp_path / "again.html", runs, title="Three seeds", outline=CORRIDOR)
    assert (tmp_path / "again.html").read_text() == text


@pytest.mark.slow
def test_full_size_report_stays_small(tmp_path: Path) -> None:
    text = written(tmp_path, corridor_comparison(0), corridor_comparison(1, count=COUNT, size=48, name="late evening"))
    assert len(text.encode()) < 4_000_000
    assert re.findall(r"<h2>(.*)</h2>", text) == ["16:00 → 18:00", "late evening", "What was driven"]


NOTES = "wet floor, " * 20 + "\n<b>door 3</b> half open"


@pytest.fixture(scope="module")
def odd(runs: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> str:
    """A page of two drives that tell things that are long, of several lines, or look like a program."""
    metadata = {"light": "<script>alert(1)</script>", "config": "speed = 0.5; " * 50, "notes": NOTES}
    noted = [replace(chain_alone(run), name="<b>A & B</b>", query_metadata=metadata) for run in runs[:2]]
    return written(tmp_path_factory.mktemp("odd"), *noted, title="<i>t</i>")


def test_text_from_outside_is_escaped(odd: str) -> None:
    assert "alert(1)</script>" not in odd
    assert odd.count("<script") == 1
    assert "<b>A" not in odd
    assert "&lt;b&gt;A &amp; B&lt;/b&gt;" in odd


def test_long_metadata_is_folded_away(odd: str) -> None:
    assert "<summary>query: config</summary>" in odd
    assert "config" not in [row[0] for row in Page(odd).rows]


@pytest.mark.quick_cases(r"./$\\frac$")
@pytest.mark.parametrize("name", ["./my$loc_$x", r"./$\frac$", r"a\$b"])
def test_names_are_drawn_as_they_are_written_whatever_stands_between_dollars(runs: list[Comparison], name: str) -> None:
    run = replace(runs[0], beliefs={name: runs[0].beliefs[Stage.CHAIN], "n": runs[0].beliefs[Stage.PRIOR]})
    assert f">{name}</text>" in belief_heatmaps(run, None, WIDE).svg
    assert confidence(run, None, WIDE).legend[0].label == name
    sheet = contact_sheet(name, [CaptionedImage(np.zeros((4, 4), np.uint8), name)])
    sheet.savefig(io.BytesIO(), format="png")


def test_nothing_is_drawn_with_names_taken_for_mathematics() -> None:
    """Drawings that are not of the page's style say it for themselves."""
    for file in Path(scenarios.__file__).parent.rglob("*.py"):
        text = file.read_text()
        assert "mpl.rc_context(" not in text or "AS_WRITTEN" in text or "parse_math=False" in text, file


def test_metadata_that_are_long_on_one_side_are_told_of_both(runs: list[Comparison]) -> None:
    one = replace(runs[0], reference_metadata={"odometry": "wheels", "a": 1}, query_metadata={"odometry": "w" * 99})
    assert facts([one]) == [("a", "1", "n/a")]
    assert details([one]) == [("query: odometry", "w" * 99), ("reference: odometry", "wheels")]


LED = {
    "careful": ({}, None),
    "aside": ({"side": -0.2}, "0.2 m to the right"),
    "weaving": ({**asdict(STYLES["weaving"]), "side": 0.6, "strength": 2}, "weaving, strength 2, 0.6 m to the left"),
    "own": ({"speed": 0.2}, "own"),
    "of another version": ({"haste": 1}, None),
    "no numbers": ({"side": "left"}, None),
    "nobody": (None, None),
}


@pytest.mark.parametrize(("style", "told"), LED.values(), ids=LED)
def test_who_led_is_told_where_it_was_no_careful_person(
    style: dict[str, Any] | None, told: str | None, runs: list[Comparison]
) -> None:
    led = {"config": json.dumps({"operator": style})}
    one = replace(runs[0], reference_metadata={}, query_metadata=led)
    assert [row for row in facts([one]) if row[0] == "operator"] == ([("operator", "n/a", told)] if told else [])


def test_notes_stand_among_what_was_driven_however_long_they_are(odd: str) -> None:
    shown = NOTES.replace("<", "&lt;").replace(">", "&gt;")
    assert '<tr class="written"><th>notes</th>' in odd
    assert f"<td>{shown}</td>" in odd
    assert "query: notes" not in odd


def test_cost_is_in_milliseconds(tmp_path: Path, runs: list[Comparison]) -> None:
    seconds = [replace(certain(COUNT, 0), timings=Timings(features=0.001 * t)) for t in range(COUNT)]
    page = Page(written(tmp_path, replace(runs[0], beliefs={Stage.CHAIN: seconds})))
    heading, row = (next(r for r in page.rows if r[:2] == [first, second]) for first, second in (
        ("method", "features [ms]"), (Stage.CHAIN.label, "14.50 / 27.55")))  # fmt: skip
    cost = dict(zip(heading, row, strict=True))
    assert cost["total [ms]"] == "14.50 / 27.55"
    assert cost["mixture [ms]"] == "0.00 / 0.00"


def test_drives_without_truth_are_shown_but_not_scored(tmp_path: Path, runs: list[Comparison]) -> None:
    text = written(tmp_path, replace(chain_alone(runs[0]), query_views=blind(runs[0].query_views)))
    assert "No score: the query drive has no true poses." in text
    assert ["says lost [views]", "jumps [steps]"] in [row[1:3] for row in Page(text).rows]
    assert text.count('<figure class="plot') == 3  # way along the map, belief and lost need no truth
    assert len(Page(text).pictures) == 16
    assert "%]" not in text


def blind(views: Sequence[View]) -> list[View]:
    return [replace(view, truth=None) for view in views]


def test_of_runs_the_first_with_truth_is_drawn(runs: list[Comparison]) -> None:
    first, *others = map(chain_alone, runs)
    unknown = replace(first, reference_views=blind(first.reference_views))
    seen = section("any", [unknown, *others], SectionSettings())
    alone = section("any", others, SectionSettings())
    assert seen.drawn == "the first that has true poses of 3 runs (query seed 1001)"
    assert (seen.plots.plan, seen.plots.errors, seen.places) == (alone.plots.plan, alone.plots.errors, alone.places)


def test_a_learnt_drive_without_truth_has_no_band_of_right_answers(tmp_path: Path, runs: list[Comparison]) -> None:
    half = COUNT // 2
    views = runs[0].reference_views
    mixed = replace(
        chain_alone(runs[0]),
        reference_views=[*views[:half], *blind(views[half:])],
        drives=Drives(("east", "west"), (half, COUNT - half)),
    )
    axes = Figure().subplots()
    draw_truth(axes, mixed.query_views, path_of(mixed), WIDE, [])
    assert len(axes.collections) == 1
    assert "No score" not in written(tmp_path, mixed)


def test_the_verdict_and_the_picture_come_first_and_what_was_driven_last(text: str) -> None:
    order = ['<p class="lead">', '<figure class="plot first">', "<h3>Figures</h3>", "<h2>What was driven</h2>"]
    found = [text.index(one) for one in order]
    assert found == sorted(found)
    assert "<section>" not in text[found[-1] :]


def headline_of(comparison: Comparison) -> Headline:
    (found,) = figures([comparison])
    return headline(found, unscored_reason([comparison]))


def test_the_headline_counts_the_views() -> None:
    reference = [View(float(k), distance=1.0, truth=Pose(float(k), 0.0, 0.0)) for k in range(9)]
    truths = [Pose(0.0, 0.0, 0.0), Pose(1.0, 0.0, 0.0), Pose(2.0, 0.0, 0.0), Pose(3.0, 50.0, 0.0), None]
    query = [View(float(t), distance=1.0, truth=truth) for t, truth in enumerate(truths)]
    answers = [certain(9, 0), certain(9, 8), certain(9, 2, lost=0.9), certain(9, 3), certain(9, 4)]
    some = Comparison("some", reference, {}, query, {}, {Stage.CHAIN: answers})
    found = headline_of(some)
    assert found.verdict == "Right at 1 of 3 views (33.3 %), wrong at 1, lost at 1"
    assert "Of 1 view off the map it says lost at 0 and answers 1. 1 view without a true pose is not" in found.more
    unscored = headline_of(replace(some, query_views=blind(query)))
    assert unscored.verdict == "Answered 4 of 5 views, lost at 1"
    # From place 0 to 8 in one metre, from 8 to 3 in two: both are farther than 3 m beyond the way.
    assert "Of 3 steps from answer to answer 1 is farther than odometry allows." in unscored.more
    still = [replace(view, truth=None, distance=0.0) for view in query]
    assert headline_of(replace(some, query_views=still)).more.endswith("There is no odometry to compare with.")


@pytest.mark.parametrize("odometry", [True, False])
def test_the_way_along_the_map_is_drawn_without_truth(runs: list[Comparison], odometry: bool) -> None:
    def bare(views: Sequence[View]) -> list[View]:
        return [replace(view, truth=None, distance=view.distance if odometry else 0.0) for view in views]

    run = replace(runs[0], reference_views=bare(runs[0].reference_views), query_views=bare(runs[0].query_views))
    drawn = answers_over_odometer(run, Stage.CHAIN, WIDE)
    labels = [entry.label for entry in drawn.legend]
    assert labels[:3] == [stage.label for stage in Stage]
    assert any("jumps" in label for label in labels) is odometry
    assert ("distance along the map [m]" in drawn.svg) is odometry
    assert "nan" not in drawn.svg
    half = COUNT // 2
    two = answers_over_odometer(replace(run, drives=Drives(("east", "west"), (half, COUNT - half))), Stage.PRIOR, WIDE)
    assert {"east", "west"} <= set(re.findall(r"<text[^>]*>([^<]+)</text>", two.svg))


def test_views_off_the_map_without_truth_or_pictures_are_fine(tmp_path: Path) -> None:
    reference = [View(float(k), truth=Pose(float(k), 0.0, 0.0)) for k in range(5)]
    query = [View(0.0, truth=Pose(1.0, 0.0, 0.0)), View(1.0), View(2.0, truth=Pose(1.0, 50.0, 0.0))]
    beliefs = {Stage.CHAIN: [certain(5, 1), certain(5, 1), certain(5, 1, lost=0.9)]}
    page = Page(text := written(tmp_path, Comparison("sparse", reference, {}, query, {}, beliefs)))
    assert "1 view has no true pose" in text
    assert page.pictures == []
    label = Stage.CHAIN.label
    _, further, off_map, _ = (row for row in page.rows if row[0] == label)
    assert further[1] == "0 / 0 / 0 / 1"
    assert off_map == [label, "1.000", "0 %", "0.050", "0.00 m", "n/a", "0.00 m"]


def test_methods_are_told_apart_by_colour_by_line_and_by_marker() -> None:
    for methods in (METHODS, [*Stage, "one", "other"]):
        for looks in zip(*method_styles(methods).values(), strict=True):
            assert len(set(looks)) == len(methods)


def test_any_method_is_shown_beside_the_stages(tmp_path: Path, runs: list[Comparison]) -> None:
    beliefs = {"mine": runs[0].beliefs[Stage.CHAIN], **runs[0].beliefs}
    page = Page(text := written(tmp_path, replace(runs[0], beliefs=beliefs)))
    labels = [*(stage.label for stage in Stage), "mine"]
    assert [row[0] for row in page.rows if row[0] in labels] == labels * 4  # four tables, stages first
    assert page.row("mine")[1:] == page.row(Stage.CHAIN.label)[1:]
    assert text.count('<figure class="plot') == 7


def test_each_experiment_is_drawn_in_the_world_of_its_query(tmp_path: Path) -> None:
    runs = [chain_alone(corridor_comparison(0, count=3, size=24, name=name)) for name in ("known", "unknown")]
    known, unknown = runs[0], replace(runs[1], query_metadata={"world": "abbey"})
    other = replace(known, name="other", reference_metadata={"world": "abbey"})
    _, *sections = written(tmp_path, known, unknown, other).split("<h2>")
    assert [one.count(QUERY_WALLS) for one in sections] == [1, 0, 1, 0], "the last tells what was driven"


def test_only_a_narrow_plan_is_stretched() -> None:
    corridor = corridor_comparison(0, count=COUNT, size=24)
    drawn = drive_plan(corridor, score(corridor, Stage.CHAIN), CORRIDOR)
    assert re.fullmatch(r"The y axis is drawn \d+\.\d times as large as the x axis\.", drawn.note)

    def squeezed(views: Any) -> list[View]:
        return [replace(v, truth=Pose(v.truth.x / 10, v.truth.y * 10, 0.0)) for v in views]

    square = replace(
        corridor, reference_views=squeezed(corridor.reference_views), query_views=squeezed(corridor.query_views)
    )
    assert drive_plan(square, score(square, Stage.CHAIN), None).note == ""


def test_an_empty_report_is_refused_and_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "r.html"
    path.write_text("old")
    with pytest.raises(ScenarioError, match="0 comparisons; valid is at least one"):
        write_report(path, [], title="none", outline=None)
    assert path.read_text() == "old"


def test_harm_is_told_of_profiles_by_their_own_single_view() -> None:
    whole = corridor_comparison(count=COUNT, size=24)
    named = {f"best/{stage}": beliefs for stage, beliefs in whole.beliefs.items()}
    columns = [
        [further_row(one).cells[2] for one in figures([replace(whole, beliefs=beliefs)])]
        for beliefs in (whole.beliefs, {**named, "topometric": whole.beliefs[Stage.CHAIN]})
    ]
    assert columns[0][0] == "n/a"
    assert all(re.fullmatch(r"\d+ of \d+", text) for text in columns[0][1:])
    assert columns[1] == [*columns[0], "n/a"]


def test_precision_and_recall_are_drawn_as_they_are_scored(runs: list[Comparison]) -> None:
    curve = score(runs[0], Stage.UNIFORM).retrieval
    assert curve is not None
    axes = Figure().add_subplot()
    draw_retrieval(axes, curve, method_styles(["m"])["m"], "m")
    steps, end = axes.lines
    recall, precision = (np.asarray(values, float) for values in steps.get_data())
    assert steps.get_drawstyle() == "steps-pre"
    assert float(np.sum(np.diff(recall) * precision[1:])) == pytest.approx(curve.auc)
    assert list(zip(recall[1:], precision[1:], strict=True)) == list(zip(curve.recall, curve.precision, strict=True))
    assert (end.get_xdata()[-1], end.get_ydata()[-1]) == (curve.recall[-1], curve.precision[-1])  # type: ignore[index]
    assert f"AUC {curve.auc:.3f}" in str(steps.get_label())


def test_shares_are_drawn_with_their_intervals() -> None:
    shares = np.array([[0.9, 0.6, 0.98], [0.1, 0.02, 0.4], [np.nan] * 3])
    axes = Figure().add_subplot()
    draw_shares(axes, np.arange(3.0), shares, ("#000000", "-", "o"), "m")
    ((_, _, (bars,)),) = axes.containers  # type: ignore[misc]
    assert [float(y) for segment in bars.get_segments()[:2] for _, y in segment] == pytest.approx([60, 98, 2, 40])


def test_the_band_of_right_answers_is_broken_where_the_robot_was_carried(runs: list[Comparison]) -> None:
    axes = Figure().add_subplot()
    path = ReferencePath(runs[0].reference_views)
    draw_truth(axes, runs[0].query_views, path, WIDE, [10])
    for line in axes.lines:
        x, y = (np.asarray(values, float) for values in line.get_data())
        assert list(np.flatnonzero(np.isnan(x))) == [10]
        assert np.isnan(y[10])
        assert list(x[np.isfinite(x)]) == list(range(COUNT))
    before, after = (line.get_ydata() for line in axes.lines)
    assert (np.asarray(before)[[5, 20]] < np.asarray(after)[[5, 20]]).all()


def test_faults_on_the_drive_are_marked(runs: list[Comparison]) -> None:
    faults = '[{"kind": "camera-black", "camera": "forward", "at": 3.0, "until": 6.0}]'
    met = fault_spans(runs[0].query_views, {"faults": faults})
    path, scores = ReferencePath(runs[0].reference_views), {Stage.CHAIN: score(runs[0], Stage.CHAIN)}
    drawn = [
        drive_plan(runs[0], scores[Stage.CHAIN], CORRIDOR, met),
        confidence(runs[0], path, WIDE, met),
        errors_along_path(runs[0], scores, path, (WIDE, NARROW), met),
    ]
    assert [[entry.label for entry in one.legend].count("forward black from 3 m") for one in drawn] == [1, 1, 1]


def test_sensors_that_were_declared_ill_are_told_and_drawn(tmp_path: Path, runs: list[Comparison], text: str) -> None:
    blank = DeclaredFault("camera-1", FaultKind.BLANK, 3, 5.4, 12.0)
    stuck = DeclaredFault("laser", FaultKind.FROZEN, 6, 10.8, 12.0)
    stood = [(blank,) * (k >= 4) + (stuck,) * (7 <= k <= 9) for k in range(COUNT)]
    ill = {
        stage: [replace(belief, faults=faults) for belief, faults in zip(beliefs, stood, strict=True)]
        for stage, beliefs in chain_alone(runs[0]).beliefs.items()
    }
    told = written(tmp_path, replace(runs[0], beliefs=ill))
    assert (
        "Declared by the localiser: camera-1 blank since view 3 (told at view 4); "
        "laser frozen since view 6 (told at view 7) until view 9." in told
    )
    drawn = confidence(replace(runs[0], beliefs=ill), None, WIDE).svg
    assert all(f">{word}</text>" in drawn for word in ("camera-1", "laser", "blank", "frozen"))
    assert "eclared" not in text, "nobody was ill on these drives"


def test_many_methods_are_all_in_the_tables_and_few_in_the_plots(tmp_path: Path, runs: list[Comparison]) -> None:
    beliefs = {f"method-{i}": runs[0].beliefs[Stage.CHAIN if i == 7 else Stage.UNIFORM] for i in range(12)}
    text = written(tmp_path, replace(runs[0], beliefs=beliefs))
    rows = [row[0] for row in Page(text).rows]
    assert all(rows.count(method) == 4 for method in beliefs)
    in_plots = {method for method in beliefs if re.search(rf"{method} \(AUC", text)}
    assert len(in_plots) == 6
    assert {"method-7", "method-11"} <= in_plots  # the one that is right most often, and the one that is judged
    assert "The plots show 6 of\n12 methods" in text


@pytest.mark.parametrize(("pictured", "drives"), [(True, None), (False, None), (False, Drives(("a", "b"), (20, 10)))])
def test_a_page_without_what_the_places_show_tells_where_that_is(
    tmp_path: Path, pictured: bool, drives: Drives | None
) -> None:
    """A map of several drives has no recording of its places."""
    run = replace(corridor_comparison(count=COUNT, size=48), drives=drives)
    if not pictured:
        blank = [replace(view, images={}, scan=None) for view in run.reference_views]
        run = replace(run, reference_views=blank)
    write_report(tmp_path / "r.html", [run], title="One", outline=None)
    page = (tmp_path / "r.html").read_text()
    assert "no picture" in page or pictured
    asked = not pictured and drives is None
    assert page.count("by <code>--reference</code>, the drive that it was learnt from") == 2 * asked
