"""The body of ``refseq compare``: a contest of methods, its tables on the terminal, and its files."""

from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from refseq.files import replace_text
from scenarios.drives.benchmark import Benchmark, run_benchmark
from scenarios.drives.inputs import writing
from scenarios.errors import ScenarioError
from scenarios.report.document import write_report
from scenarios.report.plots.plan import FloorOutline
from scenarios.scoring.comparison import Comparison
from scenarios.scoring.figures import Figures, figures, figures_csv
from scenarios.scoring.tables import figures_table, lost_table
from scenarios.tables import print_whole
from worlds.drawing.outline import outline_of

ALL = "all drives together"


def run_comparison(
    contest: Benchmark, console: Console, step: Callable[[str], object], *, table: Path | None, report: Path | None
) -> list[tuple[str, list[Figures]]]:
    """Run a contest, print its figures for each experiment and for all together, and write what is asked for.

    ``table`` is a file for the figures (.csv), ``report`` one for the page (.html). Raises ``ScenarioError``.
    """
    if table is not None and table.suffix.lower() != ".csv":
        raise ScenarioError(f"{table}: is no table's name; valid is a name that ends in .csv")
    comparisons = run_benchmark(contest, step)
    experiments = by_experiment(comparisons)
    for name, found in experiments:
        drives = sum(1 for one in comparisons if name in (one.name, ALL))
        views = len(found[0].wide.outcomes)
        title = f"{name}: {drives} drive{'s' if drives > 1 else ''}, {views} views"
        print_whole(console, figures_table(title, found))
        if lost := lost_table("off the map, and coming back", found):
            print_whole(console, lost)
    if table is not None:
        with writing(table):
            replace_text(table, figures_csv(experiments))
    if report is not None:
        with writing(report):
            write_report(report, comparisons, title=_title(comparisons), outline=_outline(comparisons))
    return experiments


def by_experiment(comparisons: Sequence[Comparison]) -> list[tuple[str, list[Figures]]]:
    """The figures of each name's comparisons, and, where there is more than one name, of all of them."""
    names = list(dict.fromkeys(one.name for one in comparisons))
    found = [(name, figures([one for one in comparisons if one.name == name])) for name in names]
    return [*found, (ALL, figures(comparisons))] if len(names) > 1 else found


def _title(comparisons: Sequence[Comparison]) -> str:
    return "; ".join(dict.fromkeys(one.name for one in comparisons))


def _outline(comparisons: Sequence[Comparison]) -> FloorOutline | None:
    """The walls, where all drives were in the same world of the library."""
    from worlds.plans.load import load_plan, world_names

    worlds = {str(one.reference_metadata.get("world", "")) for one in comparisons}
    world = worlds.pop()
    return outline_of(load_plan(world)) if not worlds and world in world_names() else None
