"""Report a campaign's result file on the terminal and as Markdown."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from refseq_bench.scenarios.campaign.pages.decisive import corrected, power_line, smallest_words, undecided
from refseq_bench.scenarios.campaign.pages.summary import Summary, plain
from refseq_bench.scenarios.campaign.pages.verdicts import INDEX, index_row, verdict_line
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, MethodRecord, ShareRecord
from refseq_bench.scenarios.report.words import duration_text
from refseq_bench.scenarios.tables import NONE, TextTable, plural, print_whole, say

STYLES = {"passed": "green", "failed": "bold red", "error": "bold magenta", "skipped": "dim", "open": "dim"}
FIGURES = {
    "localising": {
        "AUC": "auc",
        "ECE": "ece",
        "lost AUROC": "lost_auroc",
        "error, median [m]": "error_median_m",
        "error, p95 [m]": "error_p95_m",
        "ms a view": "total_median_ms",
    },
    "mission": {
        "to the goal [m]": "goal_distance_median_m",
        "wrong switches": "wrong_switches",
        "touched": "collisions",
        "time [s]": "time_median_s",
        "time over ideal": "time_over_ideal_median",
        "BARN": "barn_mean",
        "lost": "lost_times",
    },
}
"""Figures of the result file that the table of methods shows beside success, by the form of the scenario."""


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
    if line := power_line(corrected(record)):
        say(console, line)
    if figures:
        for case in _with_figures(record):
            headings, *rows = _figures(case)
            judged = [method.method == case.judged for method in case.methods]
            print_whole(console, _table(_title(case), headings, rows, judged))
    say(console, f"look at {folder / INDEX}")


def print_summary(found: Summary, console: Console) -> None:
    """Print one figure of all methods over all cases."""
    rows = [(method, *cells) for method, cells in found.rows]
    print_whole(console, _table(found.figure, ("method", *found.cases), rows, [False] * len(rows)))


def _table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], bold: Sequence[bool]) -> TextTable:
    """Names to the left, figures to the right; some rows stand out."""
    first, *others = (heading.replace("/", "/\n") for heading in headings)
    table = TextTable(first, *(f">{heading}" for heading in others), title=title)
    for cells, stands_out in zip(rows, bold, strict=True):
        table.add_row(*cells, style="bold" if stands_out else "")
    return table


def _verdicts(title: str, cases: list[CaseRecord]) -> TextTable:
    table = TextTable("verdict", "case", "judged method", ">success", ">failures", ">met", title=title)
    for row in map(index_row, cases):
        verdict = Text(row.verdict, style=STYLES[row.verdict])
        cells = (row.name, row.judged, _within(row.success, row.within), row.failures, row.met)
        table.add_row(verdict, *cells)
    return table


def _within(share: str, tolerance: str) -> str:
    """A success rate and its tolerance, in one cell."""
    return f"{share} in {tolerance}" if tolerance else share


def _reasons(cases: list[CaseRecord]) -> Iterator[str]:
    for case in cases:
        for reason in case.reasons:
            yield f"  {case.name}: {reason}"
        if flag := undecided(case):
            yield f"  {case.name}: {flag}"


def _with_figures(record: CampaignRecord) -> list[CaseRecord]:
    return [case for case in record.cases if case.methods]


def _title(case: CaseRecord) -> str:
    seeds, views = plural(len(case.seeds), "seed"), plural(case.views, "view")
    return ", ".join((f"{case.name}: {seeds}", views, *smallest_words(case)))


def _figures(case: CaseRecord) -> list[tuple[str, ...]]:
    """All methods of a case: the headings, and a row each."""
    first, shown = case.methods[0], FIGURES[case.schema_type]
    headings = ("method", f"within {first.within_m:g} m", f"within {first.narrow_m:g} m", "failed", *shown)
    return [headings, *((one.method, *_method_cells(one, list(shown.values()))) for one in case.methods)]


def _method_cells(one: MethodRecord, names: Sequence[str]) -> list[str]:
    figures = [one.figures.get(name) for name in names]
    failed = str(one.success.of - one.success.right)
    return [_of(one.success), _of(one.success_narrow), failed, *map(plain, figures)]


def _of(share: ShareRecord) -> str:
    """A share with the number of its views."""
    return f"{share.text} of {share.of}" if share.of else NONE


def report_markdown(record: CampaignRecord, *, figures: bool) -> str:
    """The verdicts as a table in Markdown; with ``figures`` also a table of all methods for each case."""
    rows = []
    for case in sorted(record.cases, key=lambda one: not one.blocking):
        row = index_row(case)
        verdict = case.verdict_word + ("" if case.blocking else " (not blocking)")
        why = "; ".join(filter(None, (row.reason, row.undecided)))
        rows.append((verdict, row.name, row.judged, _within(row.success, row.within), row.met, why))
    headings = ("verdict", "case", "judged method", "success", "met", "why")
    parts = [f"**{verdict_line(record)}**, {duration_text(record.seconds)}\n", markdown_table(headings, rows)]
    parts += [f"{line}.\n"] if (line := power_line(corrected(record))) else []
    if figures:
        for case in _with_figures(record):
            of_methods, *methods = _figures(case)
            parts += [f"**{escaped(_title(case))}**\n", markdown_table(of_methods, methods)]
    return "\n".join(parts)


def summary_markdown(found: Summary) -> str:
    """One figure of all methods over all cases, as a table in Markdown."""
    return markdown_table((found.figure, *found.cases), [(method, *cells) for method, cells in found.rows])


def markdown_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table that no text in it can break."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join("| " + " | ".join(map(escaped, line)) + " |\n" for line in lines)


def escaped(text: str) -> str:
    """A text that cannot end its cell, nor be taken for HTML."""
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")
