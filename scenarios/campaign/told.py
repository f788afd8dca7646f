"""What came of a campaign, on the terminal and as Markdown, from its result file alone."""

from collections.abc import Iterator
from pathlib import Path

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from rich.text import Text

from scenarios.campaign.index_page import index_row, verdict_line
from scenarios.campaign.result_file import CampaignRecord, CaseRecord, MethodRecord, Number
from scenarios.campaign.results import INDEX
from scenarios.compare import print_whole
from scenarios.console import say
from scenarios.figures import NONE
from scenarios.page import duration_text

STYLES = {"passed": "green", "failed": "bold red", "error": "bold magenta", "skipped": "dim", "open": "dim"}
FIGURES = {
    "AUC": "auc",
    "ECE": "ece",
    "lost\nAUROC": "lost_auroc",
    "error [m]\nmedian": "error_median_m",
    "error [m]\np95": "error_p95_m",
    "ms a\nview": "total_median_ms",
}
"""Figures of the result file that the terminal's table of methods shows beside success."""


def print_report(record: CampaignRecord, folder: Path, console: Console, *, figures: bool) -> None:
    """Print the verdicts, those that decide first, why some did not pass, and where to look; with ``figures`` all."""
    say(console, f"{verdict_line(record)}; {duration_text(record.seconds)}, started {record.began}")
    if not record.complete:
        say(console, "not complete: the campaign still runs, or was ended before; the same command goes on")
    for blocking, title in ((True, "cases that decide"), (False, "not blocking")):
        cases = [case for case in record.cases if case.blocking is blocking]
        if cases:
            print_whole(console, _verdicts(title, cases))
            for line in _reasons(cases):
                say(console, line)
    if figures:
        for case in record.cases:
            if case.methods:
                print_whole(console, _figures(case))
    say(console, f"look at {folder / INDEX}")


def _verdicts(title: str, cases: list[CaseRecord]) -> Table:
    table = Table(title=Text(title), title_justify="left", title_style="bold", box=SIMPLE, padding=(0, 1, 0, 0))
    for heading in ("verdict", "case", "judged method"):
        table.add_column(heading, no_wrap=True)
    for heading in ("success", "success, narrow", "failures", "met", "work"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in map(index_row, cases):
        verdict = Text(row.verdict, style=STYLES[row.verdict])
        shares = _within(row.success, row.within), _within(row.success_narrow, row.narrow)
        cells = (row.name, row.judged, *shares, row.failures, row.met, row.seconds)
        table.add_row(verdict, *map(Text, cells))
    return table


def _within(share: str, tolerance: str) -> str:
    """A success rate and its tolerance, in one cell."""
    return f"{share} in {tolerance}" if tolerance else share


def _reasons(cases: list[CaseRecord]) -> Iterator[str]:
    for case in cases:
        for reason in case.reasons:
            yield f"  {case.name}: {reason}"


def _figures(case: CaseRecord) -> Table:
    """All methods of a case."""
    title = f"{case.name}: {len(case.seeds)} seed{'s' if len(case.seeds) != 1 else ''}, {case.views} views"
    table = Table(title=Text(title), title_justify="left", title_style="bold", box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("method", no_wrap=True)
    first = case.methods[0]
    headings = (f"within {first.within_m:g} m, %", f"within {first.narrow_m:g} m, %", "failed", *FIGURES)
    for heading in headings:
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for one in case.methods:
        style = "bold" if one.method == case.judged else ""
        table.add_row(Text(one.method), *(Text(cell) for cell in _method_cells(one)), style=style)
    return table


def _method_cells(one: MethodRecord) -> list[str]:
    shares = [
        f"{100 * share.share:.1f} [{100 * share.low:.0f}-{100 * share.high:.0f}] of {share.of}" if share.of else NONE
        for share in (one.success, one.success_narrow)
    ]
    figures = [one.figures.get(name) for name in FIGURES.values()]
    return [*shares, str(one.success.of - one.success.right), *(_plain(value) for value in figures)]


def _plain(value: Number | int | str) -> str:
    return NONE if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)


def verdicts_markdown(record: CampaignRecord) -> str:
    """The verdicts as a table in Markdown."""
    lines = [f"**{verdict_line(record)}**, {duration_text(record.seconds)}", ""]
    lines += ["| verdict | case | judged method | success | met | why not |", "|---|---|---|---|---|---|"]
    for case in sorted(record.cases, key=lambda one: not one.blocking):
        row = index_row(case)
        verdict = case.verdict_word + ("" if case.blocking else " (not blocking)")
        cells = (verdict, row.name, row.judged, _within(row.success, row.within), row.met, row.reason)
        lines.append("| " + " | ".join(_escaped(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    """A text that cannot end its cell, nor be taken for HTML."""
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")
