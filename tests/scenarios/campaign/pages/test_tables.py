import re
from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages.tables import CampaignRuns, blocks, filled, replaced
from refseq_bench.scenarios.campaign.store.result_file import (
    CampaignRecord,
    CaseRecord,
    RunRecord,
    SeedRecord,
    write_result,
)
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.tables import NONE
from tests.scenarios.campaign.pages.test_text_report import campaign, case, method
from tests.scenarios.conftest import Refseq

SEED = SeedRecord(reference="r", query="q", answers={}, learnt_views=5, asked_views=5)
PAGE = """# A page

Before.

<!-- table light
corner = "asked at"
show = "{failures} of {of}"
[columns]
"one | two".method = "a"
"other".method = "b"
[rows]
"by **day**".case = "day"
"by night".case = "night"
-->
| old |
<!-- end table -->

After.
"""


def judged(name: str, *rights: tuple[str, int], seeds: int = 2) -> CaseRecord:
    methods = tuple(method(name, right) for name, right in rights)
    return case(name, Verdict.PASSED, methods=methods, seeds=dict.fromkeys(range(seeds), SEED))


def run(*cases: CaseRecord, day: str = "2026-01-02") -> CampaignRecord:
    versions = {"refseq-bench": "0.1.0", "mujoco": "4.0.0"}
    return campaign(*cases).model_copy(update={"started": f"{day}T00:00:00+00:00", "versions": versions})


RUN = run(judged("day", ("a", 9), ("b", 3)), judged("night", ("a", 0)), case("late", None))


def page(*changes: tuple[str, str]) -> str:
    text = PAGE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def body(text: str, *runs: CampaignRecord) -> str:
    (block,) = blocks(text, "page.md")
    return filled(block, CampaignRuns(runs or (RUN,)))


@pytest.mark.parametrize(
    ("query", "told"),
    [("filament", "filament"), ("baked", "baked and filament"), ("none", "filament")],
)
def test_renderers_of_its_drives_are_named(query: str, told: str) -> None:
    sides = {"reference": {"renderer": "filament"}, "further": [{"log": "a.log"}], "query": {"renderer": query}}
    resolved = [one.model_copy(update={"resolved": sides}) for one in RUN.cases]
    assert f"MuJoCo 4.0.0, pictures by {told}; 2 seeds" in body(PAGE, RUN.model_copy(update={"cases": tuple(resolved)}))


def test_failures_a_seed_are_of_the_seeds_that_the_method_ran() -> None:
    """At three of five seeds it broke."""
    (record,) = run(judged("day", ("a", 6), seeds=5)).cases
    runs = {seed: RunRecord(right=3, of=5) for seed in (1, 2)}
    broken = record.model_copy(update={"methods": (record.methods[0].model_copy(update={"runs": runs}),)})
    text = body(page(("{failures} of {of}", "{failures_a_seed:g}, {seeds}"), ('"other".method = "b"\n', ""),
                     ('"by night".case = "night"\n', "")), run(broken))  # fmt: skip
    assert "| by **day** | 2, 2 |" in text
    assert "; 2 seeds a case." in text


def test_a_table_has_a_cell_for_each_row_and_column() -> None:
    assert body(PAGE) == (
        "| asked at | one \\| two | other |\n"
        "| --- | --- | --- |\n"
        "| by **day** | 1 of 10 | 7 of 10 |\n"
        "| by night | 10 of 10 |  |\n"
        "\n*Run on 2026-01-02 by refseq-bench 0.1.0 with MuJoCo 4.0.0; 2 seeds a case.*\n"
    )


def test_what_stands_around_a_table_stays() -> None:
    (block,) = blocks(PAGE, "page.md")
    text = replaced(PAGE, [(block, "new\n")])
    assert text == PAGE.replace("| old |\n", "new\n")
    assert replaced(text, [(blocks(text, "page.md")[0], "| old |\n")]) == PAGE


def test_several_tables_are_replaced_each_in_its_place() -> None:
    text = PAGE + PAGE.replace("table light", "table dark")
    found = blocks(text, "page.md")
    changed = replaced(text, [(block, f"{block.name}, and longer than before\n") for block in found])
    assert [block.body for block in blocks(changed, "page.md")] == [
        "light, and longer than before\n",
        "dark, and longer than before\n",
    ]


def test_features_are_the_mean_of_the_seeds() -> None:
    costs = {
        seed: Cost(learn_s=1, answer_s=1, places=5, bytes_kept=1, features=seen, peak_bytes=1)
        for seed, seen in ((1, 100), (2, None), (3, 300))
    }
    day, night, late = RUN.cases
    known = day.model_copy(update={"methods": tuple(one.model_copy(update={"costs": costs}) for one in day.methods)})
    told = page(("{failures} of {of}", "{features:.0f} features"))
    found = body(told, RUN.model_copy(update={"cases": (known, night, late)}))
    assert "| by **day** | 200 features | 200 features |" in found
    assert f"| by night | {NONE} features |" in found


@pytest.mark.parametrize(
    ("show", "cell"),
    [
        ("{success:.1f} %", "90.0 %"),
        ("{failures_a_seed:g}", "0.5"),
        ("{right}, {right_narrow}, {seeds}", "9, 9, 2"),
        ("{auc:.2f}", "0.50"),
    ],
)
def test_counts_and_figures_are_shown(show: str, cell: str) -> None:
    assert f"| by **day** | {cell} |" in body(page(("{failures} of {of}", show)))


def test_a_row_may_tell_all_but_what_its_column_tells() -> None:
    text = page(('show = "{failures} of {of}"\n', 'case = "day"\n'), ('"by **day**".case = "day"\n', ""))
    text = text.replace('"by night".case = "night"', '"right".show = "{right}"\n"wrong".show = "{failures}"')
    assert "| right | 9 | 3 |\n| wrong | 1 | 7 |\n" in body(text)


def test_a_figure_that_there_is_none_of_is_told() -> None:
    without = method("a", 9).model_copy(update={"figures": {"auc": None}})
    found = judged("day", ("b", 1)).model_copy(update={"methods": (without, method("b", 1))})
    text = body(page(("{failures} of {of}", "{auc:.2f}")), run(found, judged("night", ("a", 0))))
    assert "| by **day** | n/a | 0.50 |" in text


def test_a_method_that_only_the_earlier_campaign_asked_is_from_there() -> None:
    text = body(PAGE, RUN, run(judged("day", ("b", 5))))
    assert "| by **day** | 1 of 10 | 5 of 10 |" in text


def test_the_later_campaign_counts() -> None:
    later = run(judged("day", ("a", 5), ("b", 5), seeds=5), day="2026-03-04")
    text = body(PAGE, RUN, later)
    assert "| by **day** | 5 of 10 | 5 of 10 |" in text
    assert "Run on 2026-01-02 to 2026-03-04 by" in text
    assert "2 to 5 seeds a case" in text


def test_a_case_that_a_campaign_has_still_to_judge_is_not_shown_by_an_earlier_one() -> None:
    running = run(judged("day", ("a", 5)), case("night", None))
    with pytest.raises(ScenarioError, match=r"row 'by night', .*: a campaign has still to judge case 'night'; valid"):
        body(PAGE, RUN, running)


def test_all_cases_of_a_scenario_are_not_shown_while_one_is_still_to_be_judged() -> None:
    cases = judged("track/day", ("a", 9), ("b", 3)), judged("track/night", ("a", 4), ("b", 2))
    all_cases = page(('case = "day"', 'case = "track/*"'), ('case = "night"', 'case = "track/day"'))
    assert body(all_cases, run(*cases)).count("of 20") == 2
    with pytest.raises(ScenarioError, match=r"a campaign has still to judge case 'track/\*'; valid"):
        body(all_cases, run(*cases), run(cases[0], case("track/night", None)))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('case = "day"', 'case = "dusk"', "table light: row 'by **day**', column 'one | two': case 'dusk' was"),
        ('case = "day"', 'case = "late"', "case 'late' was not judged in these campaigns; valid are day, night"),
        ('method = "b"', 'method = "c"', "'other': method 'c' was not judged in these campaigns; valid are a, b"),
        ("{failures}", "{failure}", "shows 'failure'; valid are seeds, of, right, failures"),
        ("{failures}", "{failures.x}", "shows 'failures.x'; valid are seeds, of"),
        ("{failures}", "{of[0]}", "shows 'of[0]'; valid are seeds, of, right, failures"),
        ("{failures}", "{of.real}", "shows 'of.real'; valid are seeds, of, right, failures"),
        ("{failures}", "{of:{of[0]}}", "cannot be shown: 'int' object is not subscriptable"),
        ("{failures}", "{}", "cannot be shown: "),
        ("{failures}", "{auc:d}", "cannot be shown: Unknown format code 'd'"),
        ("{failures} of {of}", "{failures", "cannot be shown: expected '}'"),
        ('show = "{failures} of {of}"\n', "", "column 'one | two': show is not told; valid is one of the table"),
        ('corner = "asked at"', 'case = "night"', "case is told 'night' and 'day'; valid is one of the table"),
        ('corner = "asked at"', 'corners = ""', "corners: Extra inputs are not permitted; valid are case, method"),
        ('corner = "asked at"', "corner = ", "line 5: table light: is no TOML: Invalid value (at line 6"),
        ("<!-- end table -->", "<!-- end -->", "line 5: '<!-- table light' opens no whole table; valid is <!-- table"),
        ("<!-- table light", "<!-- table", "line 5: '<!-- table' opens no whole table"),
        ("After.", "<!-- table two\n-->\nAfter", "line 18: '<!-- table two' opens no whole table"),
        ("| old |", "<!-- table two\n-->", "line 5: '<!-- table light' opens no whole table"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_place(old: str, new: str, told: str) -> None:
    with pytest.raises(ScenarioError, match=rf"^page\.md: .*{re.escape(told)}"):
        body(page((old, new)))


def test_two_tables_of_one_name_are_told() -> None:
    with pytest.raises(ScenarioError, match=r"^page\.md: line 23: table light: the name is taken"):
        blocks(PAGE + PAGE, "page.md")


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A page, and a campaign's folder."""
    path, folder = tmp_path / "page.md", tmp_path / "campaign"
    folder.mkdir()
    path.write_text(PAGE)
    write_result(folder, RUN)
    return path, folder


def test_a_page_is_filled_once(files: tuple[Path, Path], refseq: Refseq) -> None:
    path, folder = files
    stands = refseq("scenario", "tables", str(path), str(folder), "--check")
    assert (stands.code, path.read_text()) == (1, PAGE)
    assert "table light: stands otherwise" in stands.out
    assert refseq("scenario", "tables", str(path), str(folder)).code == 0
    assert "| by **day** | 1 of 10 | 7 of 10 |\n" in path.read_text()
    again = refseq("scenario", "tables", str(path), str(folder), "--check")
    assert again.code == 0
    assert "1 of 1 tables stood as they should" in again.out


def test_only_the_tables_asked_for_are_filled(files: tuple[Path, Path], refseq: Refseq) -> None:
    path, folder = files
    path.write_text(PAGE + PAGE.replace("table light", "table dark").replace('case = "night"', 'case = "dusk"'))
    assert refseq("scenario", "tables", str(path), str(folder), "--table", "light").code == 0
    assert path.read_text().count("| old |") == 1


@pytest.mark.parametrize(
    ("change", "asked", "told"),
    [
        (('case = "night"', 'case = "dusk"'), [], "case 'dusk' was not judged"),
        (("", ""), ["--table", "dark"], "--table 'dark' is not in"),
        (("<!-- table light", "<!-- light"), [], "declares no table; valid is a page with <!-- table NAME"),
    ],
)
def test_a_page_that_cannot_be_filled_stays(
    change: tuple[str, str], asked: list[str], told: str, files: tuple[Path, Path], refseq: Refseq
) -> None:
    path, folder = files
    path.write_text(PAGE.replace(*change))
    before = path.read_bytes()
    done = refseq("scenario", "tables", str(path), str(folder), *asked)
    assert done.code == 2
    assert told in done.err
    assert done.err.count("\n") == 1
    assert path.read_bytes() == before


def test_a_page_that_is_not_there_is_one_line(tmp_path: Path, refseq: Refseq) -> None:
    done = refseq("scenario", "tables", str(tmp_path / "no.md"), str(tmp_path))
    assert done.code == 2
    assert "no.md: cannot be read: No such file or directory" in done.err
