"""Pages opened in headless Chromium: at three widths, light and dark, on paper, with keyboard and mouse.

Skipped where there is no Chromium. What needs no browser: test_style.py.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Route
from playwright.sync_api import Page as Tab

from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.results import Results
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.report.document import write_report
from refseq_bench.scenarios.report.page import SCRIPT
from refseq_bench.scenarios.scoring.comparison import Comparison
from tests.scenarios.campaign.chores import AtOnce
from tests.scenarios.campaign.made import carried_out, made_cases, write_logs
from tests.scenarios.forks import FALSE, PARTING, RIGHTLY, SHARED, compared, known, merging
from tests.support import CORRIDOR, corridor_comparison

WIDTHS = {"phone": 390, "tablet": 800, "desktop": 1280}
PAPER = 690
"""Width of A4 less its margins of 14 mm [CSS pixels], rounded up."""
DARK, WHITE = "rgb(22, 24, 27)", "rgb(255, 255, 255)"
MISSION = """
title = "Ahead, for 3 m"
seeds = [1]
expect = ["completed >= 95 %"]
[reference]
world = "offices"
renderer = "none"
behaviours = ["MN:5"]
[query]
light = "18:00"
[mission]
lamp = "ahead.lamp"
[localise]
methods = ["lamp"]
[[vary.list]]
name = "near"
"mission.goal" = [4.5, 0.0]
[[vary.list]]
name = "far"
"mission.goal" = [9.5, 0.0]
"""


class Pages(dict[str, Path]):
    """A page of each kind, which is made when it is asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __missing__(self, kind: str) -> Path:
        if kind in ("index", "case"):
            campaign = _campaign(self._folder / "campaign")
            self |= {"index": campaign / "index.html", "case": campaign / "made-1.5" / "report.html"}
        elif kind in ("missions", "completed", "failed"):
            missions = _missions(self._folder / "missions")
            self |= {"missions": missions / "index.html"}
            self |= {"completed": missions / "ahead-near" / "report.html"}
            self |= {"failed": missions / "ahead-far" / "report.html"}
        else:
            runs, title = _reported(kind)
            self[kind] = self._folder / f"{kind}.html"
            write_report(self[kind], runs, title=title, outline=CORRIDOR if kind == "report" else None)
        return self[kind]


@pytest.fixture(scope="module")
def pages(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Pages:
    """None are made where there is no browser to open them."""
    return Pages(tmp_path_factory.mktemp("pages"))


def _reported(kind: str) -> tuple[list[Comparison], str]:
    """Comparisons, and the title of their report."""
    if kind == "atlas":
        beliefs = {"best/chain": known(*range(11), *range(32, 40)), "vlad": known(*range(19))}
        return [compared(PARTING, beliefs, {"best/chain": merging(RIGHTLY, SHARED, FALSE)})], "A fork"
    runs = [corridor_comparison(seed, count=30, size=48) for seed in range(2)]
    if kind == "report":
        return runs, "Two seeds"
    blind = [replace(run, query_views=[replace(view, truth=None) for view in run.query_views]) for run in runs]
    return blind, "Without truth"


def _campaign(folder: Path) -> Path:
    """Two cases of one scenario, which miss an expectation."""
    folder.mkdir()
    write_logs(folder)
    rest = '[vary.grid]\n"score.within" = [1.5, 2.5]\n'
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(DATA, str(folder))
        cases = made_cases(folder, rest=rest)
        store = Store(folder / "store")
        results = Results(folder, cases, store)
        for case in cases:
            results.add(carried_out(case, store))
    return folder


def _missions(folder: Path) -> Path:
    """One mission that reaches its goal, and one that does not."""
    folder.mkdir()
    (folder / "ahead.lamp").write_text("1. MOVE LV 500 DIL 3000\n")
    (folder / "ahead.toml").write_text(MISSION)
    cases = load(folder / "ahead.toml")
    store = Store(folder / "store")
    results = Results(folder, cases, store)
    list(run_campaign(cases, AtOnce(store), store, Watcher(), conclude=results.add))
    return folder


@dataclass
class Opened:
    """A tab, and what it asked for, complained of, and was forbidden."""

    tab: Tab
    asked: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.on("console", lambda said: self.complaints.append(said.text))
        self.tab.on("pageerror", lambda error: self.complaints.append(str(error)))

    def go(self, path: Path) -> "Opened":
        self.tab.goto(path.as_uri())
        return self

    @property
    def outside(self) -> list[str]:
        """What was asked for that is neither a page beside nor part of it."""
        return [url for url in self.asked if not re.match(r"file:.*\.html$|data:", url)]


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    found = browser.new_context(viewport={"width": 1280, "height": 900}, color_scheme="light")
    yield found
    found.close()


@pytest.fixture
def opened(context: BrowserContext) -> Opened:
    return Opened(context.new_page())


KINDS = ["report", "atlas", "blind", "index", "case", "missions", "completed", "failed"]
SPILT = """() => [...document.body.querySelectorAll("*")]
    .filter((one) => !one.closest("svg") && !one.parentElement.closest(".scroll, details:not([open])"))
    .filter((one) => { const box = one.getBoundingClientRect(); return box.right > innerWidth + 0.5 || box.left < 0; })
    .map((one) => one.outerHTML.slice(0, 100))"""
CUT = """() => [...document.querySelectorAll("figure.plot svg")].flatMap((svg) => {
    const room = svg.getBoundingClientRect();
    return [...svg.querySelectorAll("text")]
      .filter((text) => { const box = text.getBoundingClientRect();
        return box.left < room.left - 1 || box.right > room.right + 1 || box.top < room.top - 1 ||
          box.bottom > room.bottom + 1; })
      .map((text) => text.textContent); })"""
UNSEEN = "() => [...document.images].filter((one) => !one.complete || !one.naturalWidth).map((one) => one.alt)"


CONTRAST = """() => {
  const channels = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = (colour) => {
    const [r, g, b] = channels(colour).map((c) => c / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ground = (one) => {
    for (; one; one = one.parentElement) {
      const colour = getComputedStyle(one).backgroundColor;
      if ((channels(colour)[3] ?? 1) === 1) return colour;
    }
    return "rgb(255, 255, 255)";
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
  while (texts.nextNode()) {
    const holder = texts.currentNode.parentElement;
    if (!texts.currentNode.data.trim() || holder.closest("script, style")) continue;
    const style = getComputedStyle(holder), colour = holder.closest("svg") ? style.fill : style.color;
    const [dark, bright] = [light(colour), light(ground(holder))].sort((a, b) => a - b);
    found.push([(bright + 0.05) / (dark + 0.05), texts.currentNode.data.trim().slice(0, 40)]);
  }
  return found;
}"""


def ground_of(tab: Tab) -> str:
    return str(tab.evaluate("getComputedStyle(document.body).backgroundColor"))


@pytest.mark.slow_cases("atlas", "blind")
@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_whole_in_every_width_and_colour_and_on_paper(opened: Opened, pages: Pages, kind: str) -> None:
    tab = opened.go(pages[kind]).tab
    fits_every_width(tab)
    assert tab.evaluate(CUT) == []
    assert tab.evaluate(UNSEEN) == []
    for scheme, ground in (("light", WHITE), ("dark", DARK)):
        tab.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        assert ground_of(tab) == ground
        assert faint(tab) == []
    is_whole_on_paper(tab)
    if kind == "report":
        assert tab.pdf(format="A4").startswith(b"%PDF")
    assert (opened.outside, opened.complaints) == ([], [])


def fits_every_width(tab: Tab) -> None:
    for width in WIDTHS.values():
        tab.set_viewport_size({"width": width, "height": 900})
        assert tab.evaluate("innerWidth") == width
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        assert tab.evaluate(SPILT) == []


def faint(tab: Tab) -> list[tuple[str, float]]:
    """Texts that hardly stand out from what is behind them."""
    found = tab.evaluate(CONTRAST)
    assert len(found) > 20
    return [(text, contrast) for contrast, text in found if contrast < 4.5]


def is_whole_on_paper(tab: Tab) -> None:
    """Nothing is cut and nothing is dark, though dark was chosen."""
    tab.get_by_role("button", name="Colours").click(click_count=2)
    assert ground_of(tab) == DARK
    tab.emulate_media(media="print")
    tab.set_viewport_size({"width": PAPER, "height": 1000})
    assert ground_of(tab) == WHITE
    assert tab.evaluate("document.documentElement.scrollWidth") <= PAPER
    boxes = "[...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1)"
    assert tab.evaluate(f"{boxes}.map((one) => one.textContent.slice(0, 80))") == []
    assert not tab.get_by_role("button", name="Colours").is_visible()
    assert faint(tab) == []


# --- clicking through a campaign ---


def test_an_index_leads_to_its_cases_and_they_lead_back(opened: Opened, pages: Pages) -> None:
    for index in ("index", "missions"):
        tab = opened.go(pages[index]).tab
        names = tab.locator("table.index a").all_inner_texts()
        assert len(names) == 2
        for name in names:
            tab.get_by_role("link", name=name, exact=True).first.click()
            assert tab.locator("h1").inner_text() == name
            tab.get_by_role("link", name="All cases of the campaign").click()
            assert tab.url == pages[index].as_uri()
    assert (opened.outside, opened.complaints) == ([], [])


def test_colours_are_chosen_and_kept_from_page_to_page(opened: Opened, pages: Pages) -> None:
    tab = opened.go(pages["index"]).tab
    look = tab.get_by_role("button", name="Colours")
    seen = []
    for _ in range(4):
        seen.append((look.inner_text(), ground_of(tab)))
        look.press("Enter")
    assert seen == [
        ("Colours: as the system", WHITE),
        ("Colours: light", WHITE),
        ("Colours: dark", DARK),
        ("Colours: as the system", WHITE),
    ]
    look.press("Enter")
    tab.locator("table.index a").first.click()
    assert (look.inner_text(), ground_of(tab)) == ("Colours: dark", DARK)


def test_the_rows_of_a_case_stay_together(opened: Opened, pages: Pages) -> None:
    tab = opened.go(pages["missions"]).tab
    rows = tab.locator("table.index tbody tr")
    before = rows.all_inner_texts()
    assert len(before) == 3  # the reason why one is failed is a row of its own
    told = next(row for row in before if row.strip().startswith("missed"))
    head = tab.get_by_role("columnheader", name="case")
    for order in ("ascending", "descending", None):
        head.get_by_role("button").click()
        assert head.get_attribute("aria-sort") == order
        after = rows.all_inner_texts()
        assert sorted(after) == sorted(before)
        assert "far" in after[after.index(told) - 1]
        names = tab.locator("table.index tbody th").all_inner_texts()
        assert names == (["ahead/near", "ahead/far"] if order != "ascending" else ["ahead/far", "ahead/near"])


def test_every_table_of_figures_sorts_by_every_column(opened: Opened, pages: Pages) -> None:
    tab = opened.go(pages["report"]).tab
    tables = tab.locator("table.sorts").all()
    assert len(tables) >= 4
    for table in tables:
        before = column(table, 1)
        for head in table.locator("thead button").all():
            head.dispatch_event("click")  # some lie in what is folded away
            assert sorted(column(table, 1)) == sorted(before)
            assert table.locator("[aria-sort]").count() == 1


def test_views_of_outcomes_sort_as_numbers(opened: Opened, pages: Pages) -> None:
    tab = opened.go(pages["report"]).tab
    table = tab.locator("table.sorts").first
    head = table.get_by_role("button", name="failures")
    failures = [int(text) for text in column(table, 6)]
    assert len(set(failures)) == 3
    head.focus()
    tab.keyboard.press("Enter")
    assert [int(text) for text in column(table, 6)] == sorted(failures)
    tab.keyboard.press("Space")
    assert [int(text) for text in column(table, 6)] == sorted(failures, reverse=True)
    tab.keyboard.press("Enter")
    assert [int(text) for text in column(table, 6)] == failures


def column(table: Locator, number: int) -> list[str]:
    """What stands in a column, from the top."""
    return table.locator(f"tbody tr > :nth-child({number})").all_inner_texts()


# --- the script alone ---

ORDERS = {
    "numbers": ["-3.5", "−1", "0", "2", "10", "1e2"],
    "shares": ["0 of 5", "3 of 5", "2 of 3", "12 of 12"],
    "per cent": ["9.5 % [2, 20]", "89.0 % [77, 95]", "100.0 % [94, 100]"],
    "intervals": ["[9.1, 85.0] / [1, 2]", "[60.4, 85.0] / [1, 2]"],
    "times": ["59.9 s", "1 min 05 s", "2 min 00 s", "1 h 00 min"],
    "sizes": ["999 B", "1 kB", "27.4 MB", "1.5e+03 GB"],
    "lengths, of which some never ended": ["0.00 m", "2.58 m (1 never)", "10.00 m", "never (4 of 5)"],
    "several numbers": ["2 / 40", "10 / 3"],
    "words": ["case 2", "case 10", "late evening"],
    "clock": ["08:00", "16:00", "16:30"],
}
NOTHING = ["n/a", "–", "", "n/a (6 never)", "-"]


def test_cells_are_ordered_by_what_they_say_and_what_says_nothing_is_last(opened: Opened) -> None:
    script = (files("refseq_bench.scenarios.report") / "templates" / SCRIPT).read_text("utf-8")
    for what, right in ORDERS.items():
        mixed = [*NOTHING[:2], *right[1::2], *NOTHING[2:], *right[::2]]
        rows = "".join(f"<tr><td>{text}</td></tr>" for text in mixed)
        opened.tab.goto("about:blank")
        opened.tab.set_content(f"<table class=sorts><thead><tr><th>a</th></tr></thead><tbody>{rows}</tbody></table>")
        opened.tab.add_script_tag(content=script)
        table = opened.tab.locator("table")
        found = []
        for _ in range(3):
            table.get_by_role("button").click()
            found.append(column(table, 1))
        assert found == [[*right, *NOTHING], [*reversed(right), *NOTHING], mixed], what


@pytest.mark.parametrize("kind", ["report", "index", "completed"])  # one of each template
def test_without_the_script_nothing_is_missing(browser: Browser, pages: Pages, kind: str) -> None:
    told = []
    for script in (True, False):
        context = browser.new_context(java_script_enabled=script)
        tab = Opened(context.new_page()).go(pages[kind]).tab
        told.append(tab.locator("body").inner_text())
        context.close()
    with_script, without = told
    assert with_script.removeprefix("Colours: as the system").split() == without.split()


def test_what_is_smuggled_into_a_page_is_not_run_and_not_fetched(opened: Opened, pages: Pages) -> None:
    page, run = pages["report"].with_name("smuggled.html"), "document.title = 'run'"
    bad = f'<script>{run}</script><img src="http://127.0.0.1:9/x.png" onerror="{run}">'
    page.write_text(pages["report"].read_text().replace("</h1>", f"</h1>{bad}"))
    fetched: list[str] = []

    def note(route: Route) -> None:
        fetched.append(route.request.url)
        route.abort()

    opened.tab.route("http://**", note)
    opened.go(page)
    assert opened.tab.title() == "Two seeds"
    assert sum("Content Security Policy" in line for line in opened.complaints) == 3
    assert fetched == []
    assert opened.tab.locator("th button").count() > 10  # ours runs all the same
