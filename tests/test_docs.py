"""What the pages say holds: commands are the command line's, examples run, links lead somewhere, the site is built."""

import os
import re
import shlex
import subprocess
import sys
import sysconfig
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

import numpy as np
import pytest
from typer.core import TyperGroup

from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from refseq_bench.scenarios.campaign.declare.assignment import LAMP, ODOMETRY
from refseq_bench.scenarios.campaign.declare.cases import find, names
from refseq_bench.scenarios.campaign.pages.tables import blocks
from refseq_bench.scenarios.campaign.pages.track_score import ALL
from refseq_bench.scenarios.cli.app import NAMES, command_tree, exit_code
from refseq_bench.scenarios.methods.checks import check_methods
from tests.commands import MISUSED, check_commands, own, parse
from tests.pages import ASKED, FENCE, ROOT, Example, Page, pages
from tests.support import corridor_drive

SCRIPTS = Path(sysconfig.get_path("scripts"))

BY_NAME = {page.name: page for page in pages()}
EXAMPLES = [example for page in pages() for example in page.examples]
SHELL = [example for example in EXAMPLES if example.language == "sh"]
RECORDINGS = Path(os.environ.get("REFSEQ_RECORDINGS") or ROOT.parent / "shared" / "data")


def named(example: Example) -> str:
    return example.place


# Commands


@pytest.mark.parametrize(
    "line", ["recrod hallway -o a.mcap", "record hallway", "record hallway --colour red -o a", "worlds paint", "learn"]
)
def test_the_command_line_refuses_what_it_does_not_know(line):
    with pytest.raises(MISUSED):
        parse(shlex.split(line))


@pytest.mark.parametrize("example", SHELL, ids=named)
def test_commands_are_those_of_the_command_line(example):
    check_commands(example.code)


@pytest.mark.parametrize("page", [page for page in pages() if page.name != "CHANGELOG.md"], ids=lambda page: page.name)
def test_commands_within_a_line_exist_with_their_options(page):
    """They are often shortened, so that only names are looked at; the changelog tells of commands that are gone."""
    for span in page.spans:
        if re.match(r"(\./run )?refseq \w", span):
            words = span.removeprefix("./run ").split()[1:]
            command = command_tree(*NAMES)
            while isinstance(command, TyperGroup) and words and words[0] in command.commands:
                command = command.commands[words.pop(0)]
            if isinstance(command, TyperGroup):
                assert not words or words[0] in {"…", "..."} or words[0].startswith(("-", "|")), span
            known = {name for parameter in command.params for name in parameter.opts} | {"--help"}
            assert {word for word in words if re.match(r"--?[a-z]", word)} <= known, span


# Examples


def test_all_that_is_asked_of_an_example_is_known():
    assert [example.place for example in EXAMPLES if example.asked not in ASKED] == []
    assert [example.place for example in EXAMPLES if example.asked == "file" and not example.told] == []
    assert [example.place for example in EXAMPLES if example.asked == "no" and example.language == "python"
            and not example.told] == []  # fmt: skip


def test_no_comment_about_an_example_stands_without_one():
    for page in pages():
        asked = [example for example in page.examples if f"<!-- example: {example.asked}" in page.text]
        told = len(re.findall(r"^<!-- example: ", page.text, re.MULTILINE))
        assert told <= len(asked), page.name


@pytest.fixture(scope="session")
def drives(tmp_path_factory) -> Path:
    """A reference and a query by rule, and the map: what examples take for granted."""
    folder = tmp_path_factory.mktemp("drives")
    rng = np.random.default_rng(0)
    for name in ("reference", "query"):
        views = corridor_drive(rng, 12, size=120)
        with RecordingWriter(folder / f"{name}.mcap", {"world": "made"}) as writer:
            for view in views:
                writer.write(view, view.truth)
        if name == "reference":
            learn(views).save(folder / "map.refseq")
    return folder


@pytest.fixture
def stand(tmp_path, drives, monkeypatch) -> Path:
    """A folder with those drives, as ``out`` of a checkout and where one stands."""
    (tmp_path / "out").mkdir()
    for file in drives.iterdir():
        for place in (tmp_path, tmp_path / "out"):
            (place / file.name).symlink_to(file)
    (tmp_path / "run").write_text('#!/bin/sh\n[ "$1" = refseq ] && shift && exec refseq "$@"\n')
    (tmp_path / "run").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def carry_out(page: Page, folder: Path, *asked: str) -> None:
    """Execute a page's examples of some kinds one after the other; those in Python share their names."""
    names: dict[str, object] = {"__name__": "example"}
    environment = {"REFSEQ_CACHE": str(folder / "cache"), "REFSEQ_RECORDINGS": str(RECORDINGS), "OMP_NUM_THREADS": "1"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        patch.setenv("PATH", f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}")
        for example in page.examples:
            if example.asked == "file":
                (folder / example.told).write_text(example.code)
            elif example.asked in asked:
                if example.language == "python":
                    # Lines before it, so that a trace names the page's own.
                    exec(compile("\n" * example.line + example.code, example.page, "exec"), names)
                else:
                    type_in(example)


def type_in(example: Example) -> None:
    """Execute a block of commands as somebody would who types it; each has to end with 0.

    Where all are our own, they are executed in this process, which has loaded already what each would load anew.
    """
    code = os.path.expandvars(example.code.replace("\\\n", " "))
    lines = [words for line in code.splitlines() if (words := shlex.split(line, comments=True))]
    ours = [own(words) for words in lines]
    if all(ours) and not re.search(r"[|&;<>`()]", example.code):
        assert [words for words in ours if words and exit_code(words) != 0] == [], example.place
        return
    done = subprocess.run(["sh", "-e", "-c", example.code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{example.place}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def asking(what: str) -> list[Page]:
    return [page for page in pages() if any(example.asked == what for example in page.examples)]


@pytest.mark.slow_cases("docs/api/index.md", "docs/first-run.md", "docs/gymnasium.md", "docs/live.md")
@pytest.mark.parametrize("page", asking("run"), ids=lambda page: page.name)
def test_examples_run(page, stand):
    carry_out(page, stand, "run")


@pytest.mark.slow
@pytest.mark.parametrize("page", asking("recordings"), ids=lambda page: page.name)
def test_examples_on_real_recordings_run(page, stand):
    if not RECORDINGS.is_dir():
        pytest.skip(f"no recordings of real robots in {RECORDINGS}")
    carry_out(page, stand, "recordings")


@pytest.mark.slow
@pytest.mark.parametrize("page", asking("slow"), ids=lambda page: page.name)
def test_slow_examples_run(page, stand):
    carry_out(page, stand, "run", "slow")


@pytest.mark.parametrize(
    "example",
    [one for one in EXAMPLES if one.language == "python" and one.asked != "run"],
    ids=named,
)
def test_examples_that_are_not_run_are_python(example):
    compile(example.code, example.place, "exec")


# Tables of figures

TABLES = [block for page in pages() for block in blocks(FENCE.sub("", page.text), page.name)]


@pytest.fixture(scope="session")
def columns() -> set[str]:
    """Cases of the library, and all cases of each file together."""
    return {name for case in find(names()) for name in (case.name, f"{case.file.stem}/{ALL}")}


@pytest.mark.parametrize("block", TABLES, ids=lambda block: block.name)
def test_tables_of_figures_name_cases_of_the_library_and_are_filled(block, columns):
    choices = [block.spec, *block.spec.rows.values(), *block.spec.columns.values()]
    assert {choice.case for choice in choices} - {None} <= columns
    check_methods({choice.method for choice in choices} - {None, ODOMETRY, LAMP})
    rows = [line for line in block.body.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + len(block.spec.rows)
    assert "*Run on " in block.body


# Links


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_links_lead_to_what_is_there(page):
    assert [link for link in page.links if not leads_somewhere(page, link)] == []


def leads_somewhere(page: Page, link: str) -> bool:
    """Whether there is such a file, and in a page such a heading; links to other places are taken at their word."""
    target, anchor = urldefrag(unquote(link))
    if urlsplit(target).scheme:
        return True
    path = (page.path.parent / target).resolve() if target else page.path
    if not path.exists() or not anchor:
        return path.exists()
    return path.suffix == ".md" and anchor in BY_NAME[path.relative_to(ROOT).as_posix()].anchors


def test_every_picture_is_shown_on_some_page():
    shown = {(page.path.parent / link).resolve() for page in pages() for link in page.links}
    assert [path.name for path in (ROOT / "docs" / "images").iterdir() if path not in shown] == []


# The site


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_lists_are_written_as_code_hosts_and_the_site_read_them(page):
    """The site wants four spaces before an inner list, and an empty line before one that follows a paragraph."""
    lines = page.prose.splitlines()
    assert [line for line in lines if re.match(r" {1,3}[*-] ", line)] == []
    items = [bool(re.match(r" *([*-]|\d+\.) ", line)) for line in lines]
    after = [
        line
        for line, before, item, was in zip(lines[1:], lines, items[1:], items, strict=False)
        if item and before and not was and not before.startswith(" ")
    ]
    assert after == []


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The built site. A page outside the navigation, a link to nothing and a module without a name fail it."""
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


class Reader(HTMLParser):
    """Collects what a page calls its parts, where it leads, and what a browser would load with it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attributes}
        self.ids |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if "src" in found:
            self.loaded.append(found["src"])
        if tag == "link" and found.get("rel") not in {"canonical", "next", "prev"}:
            self.loaded.append(found["href"])


@pytest.mark.slow
def test_every_page_is_on_the_site(site):
    below = [page.path.relative_to(ROOT / "docs") for page in pages() if page.name.startswith("docs/")]
    assert [page for page in below if not (site / page.with_suffix(".html")).is_file()] == []


@pytest.mark.slow
def test_links_of_the_site_lead_to_what_is_there(site):
    read = {path: Reader(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    assert site / "index.html" in read
    broken = []
    for path, page in read.items():
        if path.name == "404.html":  # its links begin at the server's root
            continue
        for link in (*page.links, *page.loaded):
            target, anchor = urldefrag(unquote(link))
            if urlsplit(target).scheme or target.startswith("data:"):
                continue
            there = (path.parent / target.partition("?")[0]).resolve() if target else path
            there = there / "index.html" if there.is_dir() else there
            if not there.is_file() or (anchor and there in read and anchor not in read[there].ids | {"__top"}):
                broken.append(f"{path.relative_to(site)}: {link}")
    assert broken == []


@pytest.mark.slow
def test_the_site_loads_nothing_from_elsewhere(site):
    pages = list(site.rglob("*.html"))
    assert site / "index.html" in pages
    for path in pages:
        loaded = Reader(path.read_text(encoding="utf-8")).loaded
        assert [one for one in loaded if urlsplit(one).scheme not in {"", "data"} or one.startswith("//")] == []
    for style in site.rglob("*.css"):
        assert re.findall(r"""url\(["']?(?:https?:)?//[^)]*""", style.read_text(encoding="utf-8")) == []
