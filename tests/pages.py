"""The project's pages, read for their tests: blocks of code with what is asked of each, headings, links.

A comment above a block of code says what its test does with it; a reader does not see it::

    <!-- example: run -->            executed, in a folder of the page's own, after the page's blocks before it
    <!-- example: slow -->           the same, among the slow tests
    <!-- example: file NAME -->      becomes that file in the page's folder
    <!-- example: recordings -->     executed where recordings of real robots are at hand
    <!-- example: no, REASON -->     only read

Without it Python is executed and all else is only read. Commands are parsed in any case.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ASKED = ("run", "slow", "recordings", "file", "no")
TOP = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")

FENCE = re.compile(
    r"(?:^<!-- example: (?P<asked>.+?) -->\n\n?)?^```(?P<language>\w*)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL
)
SPAN = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"!?\[[^\]]*\]\(<?([^)\s>]+)>?\)")
HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


@dataclass(frozen=True)
class Example:
    """A block of code: where it begins, in what language, and what is asked of it, one of ``ASKED``.

    ``told`` is what follows that word: a file's name, or a reason.
    """

    page: str
    line: int
    language: str
    code: str
    asked: str
    told: str

    @property
    def place(self) -> str:
        """Page and line."""
        return f"{self.page}:{self.line}"


@dataclass(frozen=True)
class Page:
    """A page in Markdown by its path from the project's root."""

    name: str

    @property
    def path(self) -> Path:
        """Where it lies."""
        return ROOT / self.name

    @cached_property
    def text(self) -> str:
        """All of it."""
        return self.path.read_text(encoding="utf-8")

    @property
    def examples(self) -> list[Example]:
        """Its blocks of code."""
        found = []
        for match in FENCE.finditer(self.text):
            language = match["language"]
            asked, _, told = (match["asked"] or ("run" if language == "python" else "no")).partition(" ")
            line = self.text.count("\n", 0, match.start("language")) + 1
            found.append(Example(self.name, line, language, match["code"], asked.rstrip(","), told))
        return found

    @cached_property
    def prose(self) -> str:
        """It without blocks of code and comments."""
        return COMMENT.sub("", FENCE.sub("", self.text))

    @property
    def spans(self) -> list[str]:
        """What stands as code within a line."""
        return SPAN.findall(self.prose)

    @property
    def links(self) -> list[str]:
        """Targets of its links and pictures."""
        return LINK.findall(SPAN.sub("", self.prose))

    @property
    def anchors(self) -> set[str]:
        """What its headings are called in links, as code hosts and the site do it."""
        return set(_unique(map(_slug, HEADING.findall(self.prose))))


def pages() -> list[Page]:
    """All pages: those at the top and those of ``docs``."""
    below = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
    return [Page(name) for name in (*TOP, *below)]


def _slug(heading: str) -> str:
    words = re.sub(r"[^\w\- ]", "", LINK.sub(_text_of, heading).replace("`", "").lower())
    return words.strip().replace(" ", "-")


def _text_of(link: re.Match[str]) -> str:
    return link.group().lstrip("!").partition("]")[0][1:]


def _unique(slugs: Iterator[str]) -> Iterator[str]:
    counts: dict[str, int] = {}
    for slug in slugs:
        counts[slug] = counts.get(slug, -1) + 1
        yield slug if not counts[slug] else f"{slug}-{counts[slug]}"
