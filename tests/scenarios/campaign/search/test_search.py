import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.search import search as searching
from refseq_bench.scenarios.campaign.search.dials import Point, Scale, at_point, dials_of
from refseq_bench.scenarios.campaign.search.found_files import scenario_text
from refseq_bench.scenarios.campaign.search.search import SearchResult, search
from refseq_bench.scenarios.campaign.search.seek import Found, Prober, seek
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.errors import ScenarioError
from tests.scenarios.campaign.chores import AtOnce, scenario_in
from tests.scenarios.campaign.search.test_dials import case_in
from tests.scenarios.campaign.search.test_shrink import kept
from tests.scenarios.conftest import Refseq

X, Y = (Scale(name, 0.0, kept, 0.0, 10.0, 1.0) for name in ("x", "y"))  # type: ignore[arg-type]
DIALS = {"x": X, "y": Y}


def valley(point: Point) -> Found:
    """A method that does worst at (8, 3) and fails near it only; at x = 10 nobody can drive."""
    x, y = float(point.get("x", 0.0)), float(point.get("y", 0.0))
    if x == 10.0:
        return Found(point, math.nan, math.nan, "stuck")
    share = min(1.0, 0.1 * math.dist((x, y), (8.0, 3.0)))
    return Found(point, share, share)


def test_search_finds_the_worst_of_all_points_and_what_is_needed_for_it() -> None:
    found = search(valley, DIALS, 60, seed=1, enough=0.35, say=lambda _line: None)
    by_force = min((valley({"x": float(x), "y": float(y)}).value, x, y) for x in range(10) for y in range(11))
    assert found.worst.value <= by_force[0] + 0.11
    assert found.smallest is not None
    assert found.smallest.success < 0.35
    assert dict(found.smallest.point) == {"x": 7.0, "y": 0.0} or "y" not in found.smallest.point


def test_points_are_chosen_by_those_before_them() -> None:
    """The last ones are far nearer to the worst than as many that are drawn evenly ever are, by five deviations."""
    even = [valley({"x": float(x), "y": float(y)}).value for x in range(10) for y in range(11)]
    found = [[one.value for one in seek(valley, DIALS, 60, seed) if not math.isnan(one.value)] for seed in range(4)]
    late = np.ravel([values[-15:] for values in found])
    assert late.mean() < np.mean(even) - 5 * np.std(even) / math.sqrt(len(late))


def test_where_nobody_can_drive_costs_no_point_and_is_left_alone() -> None:
    def half(point: Point) -> Found:
        return Found(point, math.nan, math.nan, "stuck") if float(point["x"]) > 4 else valley(point)

    def drivable(found: list[Found]) -> list[bool]:
        return [not math.isnan(one.value) for one in found]

    tried = [drivable(list(seek(half, DIALS, 30, seed))) for seed in range(4)]
    assert all(sum(one) == 30 and one[-1] for one in tried)
    assert np.mean([one[-15:] for one in tried]) > 0.55, "of points that are drawn evenly 5 of 11"


def test_a_search_ends_though_nobody_can_drive_anywhere() -> None:
    assert len(list(seek(lambda point: Found(point, math.nan, math.nan, "stuck"), DIALS, 5, seed=1))) == 10


def test_the_worst_failure_is_a_failure() -> None:
    """The narrow share of many points is 0, though they pass; those that fail have a higher mean."""

    def passing(point: Point) -> Found:
        x, y = float(point.get("x", 0.0)), float(point.get("y", 0.0))
        return Found(point, 0.75, 0.75) if x > 5 else Found(point, 0.95, 0.0 if y > 0 else 1.0)

    found = search(passing, DIALS, 12, seed=1, enough=0.8, say=lambda _line: None)
    assert any(one.success > 0.8 and one.value < 0.5 for one in found.points)
    assert found.worst.success == 0.75


def test_a_point_that_shrinking_finds_to_be_worse_is_the_worst() -> None:
    """One dial alone does more harm than both: the search sees both turned, shrinking one at a time."""

    def crossed(point: Point) -> Found:
        turned = len(point) - list(point.values()).count(0.0)
        return (Found(point, 1.0, 1.0), Found(point, 0.7, 0.35), Found(point, 0.72, 0.61))[turned]

    found = search(crossed, {"x": narrowed(X), "y": narrowed(Y)}, 2, seed=1, enough=0.8, say=lambda _line: None)
    assert found.smallest is not None
    assert found.worst.value == found.smallest.value == min(one.value for one in found.points)


def narrowed(dial: Scale) -> Scale:
    """The same without its easy value, which the search cannot draw then."""
    return replace(dial, least=1.0)


def test_same_seed_seeks_the_same_points_and_another_others() -> None:
    points = [[one.point for one in seek(valley, DIALS, 12, seed)] for seed in (1, 1, 2)]
    assert points[0] == points[1] != points[2]


def test_no_failure_is_told_as_that_and_no_easy_point_as_bad_input() -> None:
    def perfect(point: Point) -> Found:
        return Found(point, 1.0, 1.0)

    assert search(perfect, DIALS, 3, seed=1, enough=0.8, say=lambda _line: None).smallest is None
    with pytest.raises(ScenarioError, match=r"the scenario as it stands: 20.0 %.*valid is one with 80 % or more"):
        search(lambda point: Found(point, 0.2, 0.2), DIALS, 3, seed=1, enough=0.8, say=lambda _line: None)


def test_what_is_found_is_the_same_scenario_elsewhere(tmp_path: Path) -> None:
    """A file that is written in another folder drives what was driven, from a plan beside the first."""
    case = load(scenario_in(tmp_path))[0]
    dials = dials_of(case)
    turned = at_point(case, dials, {"people": 0.3, "spread": "as-built", "operator": 2.0})
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "found.toml").write_text(scenario_text(turned, folder, title="t", note="n", expect="success >= 80 %"))
    (again,) = load(folder / "found.toml")
    for mine, theirs in zip(turned.sources(1), again.sources(1), strict=True):
        assert Path(mine.world).resolve() == Path(theirs.world).resolve()  # type: ignore[union-attr]
        assert repr(mine).replace(mine.world, "") == repr(theirs).replace(theirs.world, "")  # type: ignore[union-attr]
    assert (again.scenario.methods, again.scenario.blocking) == (turned.scenario.methods, False)


def test_every_drive_of_a_found_file_is_as_it_was(tmp_path: Path) -> None:
    more = 'faults = [{ kind = "kidnap", at = 5.0, to = 9.0 }]\n[localise]\nsensors = ["camera-1"]'
    case = case_in(tmp_path, more=more)
    text = scenario_text(case, tmp_path, title='quoted "t"', note="", expect="success >= 80 %")
    (tmp_path / "again.toml").write_text(text)
    assert load(tmp_path / "again.toml")[0].sources(1) == case.sources(1)
    assert tomllib.loads(text)["localise"] == {"sensors": ["camera-1"]}


def test_prober_drives_each_point_once(tmp_path: Path) -> None:
    case = load(scenario_in(tmp_path))[0]
    dials: Mapping[str, Scale] = {"people": dials_of(case)["people"]}  # type: ignore[dict-item]
    store = Store(tmp_path / "store")
    probe = Prober(case, dials, AtOnce(store), store)
    easy = probe({})
    assert 0.0 <= easy.narrow <= easy.success <= 1.0
    assert probe({"people": 0.0}) is easy


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (("--method", "thesis/chain", "--budget", "0"), "--budget '0' is not valid"),
        (("--method", "nobody", "--budget", "2"), "method 'nobody' is unknown"),
        (("--method", "best", "--budget", "2"), "--method best: stands for several; valid is one, such as best/chain"),
        (("--method", "best+chain.window=9", "--budget", "2"), "stands for several; valid is one, such as best+chain"),
        (("--method", "thesis/chain", "--budget", "2", "--dial", "hour"), "--dial 'hour': tiny has no such dial"),
        (("--method", "thesis/chain", "--budget", "2", "--seeds", "x"), "--seeds 'x' is not valid"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    options: tuple[str, ...], line: str, tmp_path: Path, refseq: Refseq
) -> None:
    answer = refseq("scenario", "search", scenario_in(tmp_path), *options, "-o", tmp_path / "out")
    assert answer.code == 2
    assert line in answer.err
    assert len(answer.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="there is no /proc, where nobody makes a folder")
def test_a_folder_that_nobody_can_make_is_told_before_anything_is_driven(tmp_path: Path, refseq: Refseq) -> None:
    answer = refseq(
        "scenario", "search", scenario_in(tmp_path), "--method", "vlad", "--budget", "2", "-o", "/proc/out/x"
    )
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == "error: /proc/out/x: cannot be written: no write access to folder /proc\n"


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ((), ""),
        (("--renderer", "baked"), ""),
        (("--renderer", "classic"), " --renderer classic"),
        (
            ("--renderer", "filament", "--seeds", "2, 3", "--dial", "people=0:0.5", "--dial", "operator"),
            " --dial people=0:0.5 --dial operator --seeds '2, 3' --renderer filament",
        ),
    ],
)
def test_what_is_found_tells_the_whole_command(
    more: tuple[str, ...], told: str, tmp_path: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(searching, "search", lambda *_, **__: SearchResult((EASY,), EASY, EASY))
    scenario_in(tmp_path)
    answer = refseq("scenario", "search", "tiny.toml", "--method", "vlad", "--budget", 3, "-o", "out", *more)
    assert answer.code == 0, answer.err
    command = f"refseq scenario search tiny.toml --method vlad --budget 3 --seed 1 --enough 80{told}"
    notes = [tomllib.loads(file.read_text())["note"] for file in tmp_path.glob("out/*.toml")]
    assert len(notes) == 2
    assert all(note.startswith(f"Found by `{command}`: ") for note in notes)


EASY = Found({}, 0.5, 0.5)


def test_search_of_several_cases_or_of_a_mission_is_refused(tmp_path: Path, refseq: Refseq) -> None:
    for name, line in (("light-dial", "makes 6 cases"), ("second-door/18:00", "is no scenario of simulated drives")):
        answer = refseq("scenario", "search", name, "--method", "best/chain", "--budget", "1", "-o", tmp_path / "out")
        assert (answer.code, line in answer.err) == (2, True)
