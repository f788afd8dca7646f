"""The commands ``refseq scenario list | show | template | run | report | tables``."""

import signal
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import err, out, say
from scenarios.cli.scenario_show import list_scenarios, show, template
from scenarios.drives.inputs import words
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.campaign.judge.drives import Judged
    from scenarios.campaign.run.workers import WorkerPool
    from scenarios.campaign.store.cache import Store

FAILED, BROKEN, INTERRUPTED = 1, 2, 130

scenario = typer.Typer(
    help="Declared experiments: what there is, what one declares, running them, their verdicts.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)

Names = Annotated[
    list[str], typer.Argument(metavar="SCENARIO...", help="Names, cases, or tags of the library, or paths (.toml).")
]


scenario.command("list")(list_scenarios)
scenario.command("show")(show)
scenario.command("template")(template)


@scenario.command()
def run(
    scenarios: Names,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder to fill.")] = Path(
        "out/campaign"
    ),
    workers: Annotated[
        int | None,
        typer.Option("--workers", "-j", min=1, metavar="N", help="Processes on this machine. [default: 1]"),
    ] = None,
    ray: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Work on a Ray cluster instead: HOST:PORT or auto."),
    ] = None,
    cache: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where recordings and answers are kept. [default: the user's]")
    ] = None,
    seeds: Annotated[
        str | None, typer.Option(metavar="N,N", help="Only these seeds. [default: those of each scenario]")
    ] = None,
    localiser: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MODULE:CLASS", help="Judge your own localiser, or another method by its name; may be repeated."
        ),
    ] = None,
    methods: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Beside it only these methods run, commas between; none: no other."),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Ask all methods anew; recordings are kept.")] = False,
) -> None:
    """Run scenarios and judge them.

    What is kept in the cache is not done again: stop with Ctrl-C whenever you like, and the same command goes on.
    Exit code 0: all passed; 1: an expectation was missed; 2: something broke. Scenarios that are not blocking never
    change it.

    `refseq scenario run smoke`

    `refseq scenario run light-dial kidnap -j 4 -o out/nightly`

    `refseq scenario run smoke --localiser my_localiser:MyLocaliser --methods none`

    `refseq scenario run my/scenario.toml --seeds 1,2 --cache out/cache`

    `refseq scenario run thesis --ray 10.0.0.1:6379`
    """
    from scenarios.campaign.campaign import run_campaign
    from scenarios.campaign.declare.cases import find
    from scenarios.campaign.declare.overrides import with_methods, with_seeds
    from scenarios.campaign.pages.index import INDEX
    from scenarios.campaign.progress import watcher_on
    from scenarios.campaign.results import Results
    from scenarios.campaign.store.cache import Store, default_store
    from scenarios.report.words import size_text

    cases = with_seeds(with_methods(find(scenarios), localiser or (), words(methods, "methods")), seeds)
    store = Store(cache or default_store())
    folder = Results(output, cases, store)
    executor = _executor(workers, ray, store)
    watcher = watcher_on(err, executor)
    results: list[Judged] = []
    at_once = True
    with _cancelled_as_by_ctrl_c():
        try:
            judged = run_campaign(cases, executor, store, watcher, fresh=fresh, conclude=folder.add)
            results.extend(result.verdict_alone for result in judged)
            at_once = False
        except KeyboardInterrupt:
            done = f"{watcher.done} done, {watcher.kept} kept from before"
            interrupted = f"interrupted: {done}: all is kept in {store.folder}, and the same command goes on from there"
        finally:
            watcher.close()
            executor.close(at_once=at_once)
    if at_once:
        store.sweep()
        say(err, interrupted)
        raise typer.Exit(INTERRUPTED)
    _tell(results)
    say(err, f"{watcher.summary}; {size_text(store.size)} kept in {store.folder}")
    say(out, f"look at {folder.folder / INDEX}")
    _leave(results)


@scenario.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="What `refseq scenario run` filled.")] = Path(
        "out/campaign"
    ),
    figures: Annotated[bool, typer.Option("--figures", help="Print the figures of all methods as well.")] = False,
    table: Annotated[
        list[str] | None,
        typer.Option(metavar="FIGURE", help="Print only this figure, of all methods over all cases; may be repeated."),
    ] = None,
    case: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="In a table only this case or scenario; may be repeated.")
    ] = None,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print in Markdown, for the summary of a CI job, or for a page.")
    ] = False,
) -> None:
    """Tell what came of a campaign: verdicts, reasons, and where its pages lie.

    Needs nothing but the folder: not the cache, not the machine that it ran on.

    `refseq scenario report out/nightly --figures`

    `refseq scenario report out/campaign --markdown >> "$GITHUB_STEP_SUMMARY"`

    `refseq scenario report out/nightly --table failures --table lost_auroc --case kidnap`
    """
    from scenarios.campaign.pages.summary import summary
    from scenarios.campaign.pages.text_report import print_report, print_summary, report_markdown, summary_markdown
    from scenarios.campaign.store.result_file import read_result

    record = read_result(folder)
    if case and not table:
        raise ScenarioError("--case goes with --table; valid is to name a figure as well, as in --table success")
    tables = [summary(record, figure, case or ()) for figure in table or ()]
    if tables:
        for one in tables:
            if markdown:
                typer.echo(summary_markdown(one))
            else:
                print_summary(one, out)
    elif markdown:
        typer.echo(report_markdown(record, figures=figures), nl=False)
    else:
        print_report(record, folder, out, figures=figures)


@scenario.command()
def tables(
    page: Annotated[Path, typer.Argument(metavar="PAGE", help="A page in Markdown that declares tables.")],
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="What `refseq scenario run` filled.")],
    table: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this table of the page; may be repeated.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit code 1 where a table stands otherwise.")
    ] = False,
) -> None:
    """Fill a page's tables with figures of campaigns.

    A table is declared in a comment, what follows is replaced up to `<!-- end table -->` (docs/write-scenario.md).
    Where two campaigns asked a method in the same case, the later one named counts.

    `refseq scenario tables docs/results.md out/thesis out/nightly`

    `refseq scenario tables docs/results.md out/missions --table missions`
    """
    from refseq.files import replace_text
    from scenarios.campaign.pages.tables import CampaignRuns, blocks, replaced, selected_blocks, stale
    from scenarios.campaign.store.result_file import read_result

    try:
        text = page.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        told = getattr(error, "strerror", None) or "is not UTF-8"
        raise ScenarioError(f"{page}: cannot be read: {told}; valid is a page in Markdown") from error
    wanted = selected_blocks(blocks(text, str(page)), table or (), str(page))
    changed = list(stale(wanted, CampaignRuns([read_result(folder) for folder in folders])))
    for block, _ in changed:
        say(out, f"{page}: table {block.name}: " + ("stands otherwise" if check else "filled"))
    say(out, f"{page}: {len(wanted) - len(changed)} of {len(wanted)} tables stood as they should")
    if check and changed:
        raise typer.Exit(FAILED)
    if changed and not check:
        replace_text(page, replaced(text, changed))


@contextmanager
def _cancelled_as_by_ctrl_c() -> Iterator[None]:
    """Take SIGTERM, with which CI servers cancel a job, for Ctrl-C."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _executor(workers: int | None, ray: str | None, store: "Store") -> "WorkerPool":
    from scenarios.campaign.run.workers import LocalWorkers

    if ray is None:
        return LocalWorkers(workers or 1, store.folder)
    if workers is not None:
        raise ScenarioError(f"--workers {workers} and --ray {ray} exclude each other: a cluster has its own workers")
    from scenarios.campaign.run.ray_workers import RayWorkers

    return RayWorkers(ray, store)


def _tell(results: "Sequence[Judged]") -> None:
    """A line a verdict, those of scenarios that are not blocking last, and the totals."""
    for blocking in (True, False):
        apart = [result for result in results if result.case.scenario.blocking is blocking]
        for result in apart:
            say(out, f"{result.verdict.value}: {result.case.name}" + ("" if blocking else " (not blocking)"))
            for reason in result.reasons:
                say(err, f"  {reason}")
        if apart:
            counted = Counter(result.verdict.value for result in apart)
            totals = ", ".join(f"{count} {verdict}" for verdict, count in counted.items())
            say(out, f"{len(apart)} {'cases' if blocking else 'cases that are not blocking'}: {totals}")


def _leave(results: "Sequence[Judged]") -> None:
    """Leave with the code that the worst verdict of the blocking scenarios means."""
    from scenarios.campaign.declare.outcomes import Verdict

    verdicts = {result.verdict for result in results if result.case.scenario.blocking}
    if Verdict.ERROR in verdicts:
        raise typer.Exit(BROKEN)
    if Verdict.FAILED in verdicts:
        raise typer.Exit(FAILED)
