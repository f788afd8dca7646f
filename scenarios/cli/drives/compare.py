"""The command ``refseq compare``: several methods, asked about the same views."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.bars import step_bars
from refseq_bench.scenarios.cli.terminal.console import WITHOUT_TRUTH, err, out, print_json
from refseq_bench.scenarios.cli.terminal.options import (
    METHODS,
    Drives,
    GroundTruthRule,
    Json,
    Seed,
    ThinnedReading,
    grouped,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import PAGE, TABLE, file_to_write, output_file
from refseq_bench.scenarios.drives.inputs import check_output, words, writing
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq_bench.scenarios.scoring.comparison import Comparison
    from refseq_bench.scenarios.scoring.figures import Figures
    from refseq_bench.scenarios.scoring.path_geometry import Tolerance

COMPARE_HELP = """Examples:

* `refseq compare reference.mcap query.mcap`
* `refseq compare reference.mcap query.mcap --methods best/chain,topometric --first-view 40% --report report.html`
* `refseq compare reference.mcap query.mcap --places 30:80 -o figures.csv`
* `refseq compare day_left night_right --ground-truth frame±2`
* `refseq compare GardensPoint --report report.html`"""


@grouped
def compare(
    drives: Drives,
    output: Annotated[Path | None, output_file(TABLE, "Figures to write")] = None,
    report: Annotated[Path | None, file_to_write(PAGE, "Page to write as well")] = None,
    methods: Annotated[str | None, METHODS] = None,
    places: Annotated[str | None, option("FROM:TO", "Learn only these views of the reference drive.")] = None,
    first_view: Annotated[str, option("VIEW", "First view of the query drive: a number, or a share as 40%.")] = "0",
    kidnap: Annotated[
        str | None, option("FROM:TO", "Carry the robot from before view FROM of the query to view TO.")
    ] = None,
    ground_truth: GroundTruthRule = None,
    layout: Annotated[
        str | None, option("NAME", "Layout of a data set's folder: gardens-point, nordland, vpr-bench, st-lucia, sfu.")
    ] = None,
    seed: Seed = 1,
    as_json: Json = False,
    reading: ThinnedReading = ThinnedReading(),
) -> None:
    """Compare methods on the same views, baselines among them."""
    from refseq_bench.scenarios.methods.checks import methods_named

    check_output(output, report, of=drives)
    wanted = methods_named(words(methods, "methods"))

    from refseq_bench.scenarios.drives.benchmark import Benchmark, by_experiment, pairs_of, run_benchmark, tolerances_of
    from refseq_bench.scenarios.scoring.figures import figures_record

    pairs = pairs_of(drives, ground_truth, layout)
    benchmark = Benchmark(pairs, wanted, places, first_view, kidnap, seed, reading.chosen())
    failures: list[str] = []
    with step_bars() as step:
        comparisons = run_benchmark(benchmark, step, failures.append)
    tolerances = tolerances_of(benchmark, comparisons)
    experiments = by_experiment(comparisons, tolerances)
    if as_json:
        rows = ((name, one) for name, ones in experiments for one in ones)
        print_json([{"experiment": name, "method": one.method, **figures_record(one)} for name, one in rows])
    else:
        _print(experiments, comparisons)
    _write(experiments, comparisons, output, report, tolerances)
    _leave(failures)


def _leave(failures: "Sequence[str]") -> None:
    """Tell which methods failed, and leave with 1 where any did."""
    for failure in failures:
        say(err, f"failed: {failure}")
    if failures:
        raise typer.Exit(1)


def _print(experiments: "Sequence[tuple[str, Sequence[Figures]]]", comparisons: "Sequence[Comparison]") -> None:
    """The figures of each experiment, and of all together."""
    from refseq_bench.scenarios.drives.benchmark import ALL
    from refseq_bench.scenarios.scoring.tables.score_tables import consistency_table, figures_table, lost_table
    from refseq_bench.scenarios.scoring.truth import truth_estimates, unscored_reason

    for name, found in experiments:
        same = [one for one in comparisons if name in (one.name, ALL)]
        drives = len(same)
        views = len(found[0].wide.outcomes)
        title = f"{name}: {plural(drives, 'drive')}, {plural(views, 'view')}"
        out.print(figures_table(title, found))
        if lost := lost_table("off the map, and coming back", found):
            out.print(lost)
        if unscored := unscored_reason(same):
            out.print(consistency_table("method", [(one.method, one.consistency) for one in found]))
            say(out, f"not scored: {unscored}")
            say(out, WITHOUT_TRUTH)
        elif estimates := truth_estimates(same):
            say(out, f"the truth is an estimate: {', '.join(estimates)}")


def _write(
    experiments: "Sequence[tuple[str, Sequence[Figures]]]",
    comparisons: "Sequence[Comparison]",
    table: Path | None,
    report: Path | None,
    tolerances: "Mapping[str, tuple[Tolerance, Tolerance]]",
) -> None:
    from refseq.files import replace_text
    from refseq_bench.scenarios.scoring.figures import figures_csv

    if table is not None:
        with writing(table):
            replace_text(table, figures_csv(experiments))
    if report is not None:
        from refseq_bench.scenarios.report.document import write_report

        with writing(report):
            title = "; ".join(dict.fromkeys(one.name for one in comparisons))
            write_report(report, comparisons, title=title, tolerances=tolerances)
