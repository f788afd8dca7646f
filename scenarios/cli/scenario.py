"""The commands ``refseq scenario list | show | run | search | report | tables | validity | curves | template``."""

from collections import Counter
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.scenario_search import SEARCH_HELP, search
from refseq_bench.scenarios.cli.terminal.console import err, out, print_json
from refseq_bench.scenarios.cli.terminal.options import (
    CACHE,
    CAMERA_RENDERER,
    CASE,
    METHODS,
    CameraRenderer,
    Json,
    defaulting,
    flag,
    only_one_of,
    option,
    output,
)
from refseq_bench.scenarios.cli.terminal.outputs import DRAWING, output_file
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_folder, check_new, replacement, words, writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import plural, say
from refseq_bench.text_file import TextFileError, read_text

if TYPE_CHECKING:
    from refseq_bench.scenarios.campaign.declare.case import Case
    from refseq_bench.scenarios.campaign.judge.drives import Judged
    from refseq_bench.scenarios.campaign.results import Results
    from refseq_bench.scenarios.campaign.run.workers import WorkerPool
    from refseq_bench.scenarios.campaign.store.cache import Store

FAILED, BROKEN = 1, 2
TEMPLATE_CLASS = "MyLocaliser"

app = group("Run declared experiments, and read their verdicts.")

Names = Annotated[
    list[str], typer.Argument(metavar="SCENARIO", help="Names, cases or tags of the library, or paths (.toml).")
]
Campaign = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder that `refseq scenario run` filled.")]
Cases = Annotated[list[str] | None, CASE]
Cache = Annotated[Path | None, CACHE]


@app.command(
    "list",
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario list`
* `refseq scenario list thesis --json`""",
)
def list_scenarios(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENARIO", help="Only these: names, tags, or paths (.toml). [default: all]"),
    ] = None,
    as_json: Json = False,
) -> None:
    """List scenarios with their purpose, their numbers of cases and seeds, and their tags."""
    from refseq_bench.scenarios.campaign.declare.cases import find, names
    from refseq_bench.scenarios.campaign.pages.listing import by_file, list_table, listed

    files = by_file(find(scenarios or names(), runnable=False))
    if as_json:
        print_json([listed(cases) for cases in files])
    else:
        out.print(list_table(files))


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario show kidnap`
* `refseq scenario show light-dial --case noon`""",
)
def show(
    name: Annotated[str, typer.Argument(metavar="SCENARIO", help="A name, a case, a tag, or a path (.toml).")],
    case: Cases = None,
    cache: Cache = None,
    as_json: Json = False,
) -> None:
    """Show what a scenario runs, and what of it is in the cache; with --json every key and its default."""
    from refseq_bench.scenarios.campaign.declare.cases import find
    from refseq_bench.scenarios.campaign.pages.listing import lines, resolved

    cases = _only(find([name]), case or ())
    if as_json:
        print_json([resolved(one) for one in cases])
        return

    from refseq_bench.scenarios.campaign.run.estimate import rest_of
    from refseq_bench.scenarios.campaign.store.cache import Store
    from refseq_bench.user_cache import user_cache

    store = Store(cache or user_cache(), read_only=True)
    for one in cases:
        for line in lines(one, rest_of([one], store).summary):
            say(out, line)
    if len(cases) > 1:
        say(out, f"all {len(cases)} cases together, which share drives: {rest_of(cases, store).summary}")


def _only(cases: "list[Case]", names: Sequence[str]) -> "list[Case]":
    """The cases of these names, all without any. Raises ``ScenarioError``."""
    known = [{case.name, case.name.partition("/")[2]} for case in cases]
    for name in names:
        if not any(name in one for one in known):
            raise ScenarioError(f"case {name!r} is unknown; valid are {', '.join(case.name for case in cases)}")
    return [case for case, one in zip(cases, known, strict=True) if not names or one & set(names)]


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario run smoke`
* `refseq scenario run light-dial kidnap -j 4 -o out/nightly`
* `refseq scenario run smoke --localiser my_localiser:MyLocaliser --methods none`
* `refseq scenario run my/scenario.toml --seeds 1,2 --cache out/cache`
* `refseq scenario run table --renderer baked`
* `refseq scenario run thesis --ray 10.0.0.1:6379`

Stop with Ctrl-C whenever you like: the same command goes on, since nothing that is in the cache is done again.

Exit codes: 0 some passed and none failed, though others may have been skipped, which is told; 1 an expectation was
missed, or all cases were skipped; 2 an error: the bench broke, or a localiser of yours gave no valid answers. Scenarios
that are not blocking never change it.""",
)
def run(
    scenarios: Names,
    output: Annotated[Path, output("Folder to fill.", "FOLDER")] = Path("out/campaign"),
    workers: Annotated[
        int | None, option("N", "Processes on this machine. [default: 1]", "--workers", "-j", min=1)
    ] = None,
    ray: Annotated[str | None, option("ADDRESS", "Work on a Ray cluster instead: HOST:PORT or auto.")] = None,
    cache: Cache = None,
    seeds: Annotated[str | None, option("N,N", "Only these seeds. [default: those of each scenario]")] = None,
    localiser: Annotated[
        list[str] | None,
        option("NAME", "Judge your own localiser, module:Class or ./program, or another method; may be repeated."),
    ] = None,
    methods: Annotated[str | None, option("NAMES", f"{METHODS.help} none: only --localiser.")] = None,
    renderer: Annotated[CameraRenderer | None, defaulting(CAMERA_RENDERER, "that of each scenario")] = None,
    fresh: Annotated[bool, flag("--fresh", "Have all methods learn and answer anew; recordings are kept.")] = False,
) -> None:
    """Run scenarios and judge them."""
    from refseq_bench.scenarios.campaign.declare.cases import find

    only_one_of(workers=workers, ray=ray)
    check_folder(output)
    cases = _asked(find(scenarios, rejudged=bool(localiser)), localiser or (), methods, seeds, renderer)

    from refseq_bench.scenarios.campaign.results import Results
    from refseq_bench.scenarios.campaign.store.cache import Store
    from refseq_bench.user_cache import user_cache

    for line in _replaced(output, cases):
        say(err, f"note: {line}")
    store = Store(cache or user_cache())
    executor = _executor(workers, ray, store)  # before the folder is touched: a wrong address leaves what is there
    try:
        folder = Results(output, cases, store)
    except BaseException:
        executor.close(at_once=True)
        raise
    _leave(_judged(cases, folder, executor, store, fresh=fresh))


def _asked(
    declared: "list[Case]",
    localisers: Sequence[str],
    methods: str | None,
    seeds: str | None,
    renderer: CameraRenderer | None,
) -> "list[Case]":
    """The declared cases with the methods, seeds and renderer of the options, and a note of who is judged instead."""
    from refseq_bench.scenarios.campaign.declare.overrides import (
        judged_instead,
        with_methods,
        with_renderer,
        with_seeds,
    )
    from refseq_bench.sim.rendering.renderer import RendererKind

    asked = with_methods(declared, localisers, words(methods, "methods"))
    for line in judged_instead(declared, asked) if not localisers else ():
        say(err, f"note: {line}")
    return with_renderer(with_seeds(asked, seeds), RendererKind(renderer) if renderer else None)


def _replaced(folder: Path, cases: "Sequence[Case]") -> list[str]:
    """A line where the folder has the result of a campaign with other cases, in whose place these will stand."""
    from refseq_bench.scenarios.campaign.store.result_file import by_scenario, read_result

    try:
        before = read_result(folder)
    except ScenarioError:
        return []
    asked = {case.name for case in cases}
    others = list(by_scenario(one for one in before.cases if one.name not in asked))
    if not others:
        return []
    named = f"{', '.join(others[:3])}{', …' if len(others) > 3 else ''}"
    return [f"{folder} held the result of {named}, begun {before.began}; it is replaced"]


def _judged(
    cases: "Sequence[Case]", folder: "Results", executor: "WorkerPool", store: "Store", *, fresh: bool
) -> "list[Judged]":
    """Run and judge cases, and tell how they went; what is interrupted tells how to go on."""
    from refseq_bench.scenarios.campaign.campaign import run_campaign
    from refseq_bench.scenarios.campaign.pages.verdicts import INDEX
    from refseq_bench.scenarios.campaign.progress import watcher_on
    from refseq_bench.scenarios.report.words import size_text

    watcher = watcher_on(err, executor)
    results: list[Judged] = []
    at_once = True
    try:
        judged = run_campaign(cases, executor, store, watcher, fresh=fresh, conclude=folder.add)
        results.extend(result.verdict_alone for result in judged)
        at_once = False
    except KeyboardInterrupt:
        done = f"{watcher.done} done, {watcher.kept} kept from before"
    finally:
        watcher.close()
        executor.close(at_once=at_once)
    if at_once:
        store.sweep()
        raise KeyboardInterrupt(f"{done}: all is kept in {store.folder}, and the same command goes on from there")
    _tell(results)
    say(err, f"{watcher.summary}; {size_text(store.size)} kept in {store.folder}")
    say(out, f"look at {folder.folder / INDEX}")
    return results


def _executor(workers: int | None, ray: str | None, store: "Store") -> "WorkerPool":
    if ray is None:
        from refseq_bench.scenarios.campaign.run.workers import LocalWorkers

        return LocalWorkers(workers or 1, store.folder)
    from refseq_bench.scenarios.campaign.run.ray_workers import RayWorkers

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
            say(out, f"{plural(len(apart), 'case')}{'' if blocking else ' not blocking'}: {totals}")


def _leave(results: "Sequence[Judged]") -> None:
    """Leave with the code that the worst verdict of the blocking scenarios means; nothing judged is no success."""
    from refseq_bench.scenarios.campaign.declare.outcomes import Verdict

    verdicts = {result.verdict for result in results if result.case.scenario.blocking}
    if Verdict.ERROR in verdicts:
        raise typer.Exit(BROKEN)
    if Verdict.FAILED in verdicts or verdicts == {Verdict.SKIPPED}:
        raise typer.Exit(FAILED)


app.command(cls=BenchCommand, epilog=SEARCH_HELP)(search)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario report out/nightly --figures`
* `refseq scenario report out/campaign --markdown >> "$GITHUB_STEP_SUMMARY"`
* `refseq scenario report out/nightly --across failures --across lost_auroc --case kidnap`

It needs nothing but the folder: not the cache, not the machine that it ran on.""",
)
def report(
    folder: Campaign = Path("out/campaign"),
    figures: Annotated[bool, flag("--figures", "Print the figures of all methods as well.")] = False,
    across: Annotated[
        list[str] | None, option("FIGURE", "Print only this figure, of all methods over all cases; may be repeated.")
    ] = None,
    case: Cases = None,
    markdown: Annotated[
        bool, flag("--markdown", "Print Markdown, for the summary of a CI job, or for a page.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Print a campaign's verdicts, their reasons, and the place of its pages."""
    from refseq_bench.scenarios.campaign.pages.summary import summary
    from refseq_bench.scenarios.campaign.pages.text_report import (
        print_report,
        print_summary,
        report_markdown,
        summary_markdown,
    )
    from refseq_bench.scenarios.campaign.store.result_file import read_result

    only_one_of(markdown=markdown, json=as_json)
    for other in ({"json": as_json}, {"across": across or None}):  # which have the figures that they have
        only_one_of(figures=figures, **other)
    if case and not across:
        raise ScenarioError("--case goes with --across; valid is to name a figure as well, as in --across success")
    record = read_result(folder)
    tables = [summary(record, figure, case or ()) for figure in across or ()]
    if as_json:
        print_json(tables or record)
    elif tables:
        for table in tables:
            if markdown:
                typer.echo(summary_markdown(table))
            else:
                print_summary(table, out)
    elif markdown:
        typer.echo(report_markdown(record, figures=figures), nl=False)
    else:
        print_report(record, folder, out, figures=figures)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario tables docs/results.md out/thesis out/nightly`
* `refseq scenario tables docs/results.md out/missions --table missions`

A table is declared in a comment; the lines up to `<!-- end table -->` are replaced (docs/write-scenario.md). Where two
campaigns asked a method in the same case, the later one named counts.""",
)
def tables(
    page: Annotated[Path, typer.Argument(metavar="PAGE", help="A page in Markdown that declares tables.")],
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER", help="Folders that `refseq scenario run` filled.")],
    table: Annotated[list[str] | None, option("NAME", "Only this table of the page; may be repeated.")] = None,
    check: Annotated[bool, flag("--check", "Write nothing; exit 1 where a table stands otherwise.")] = False,
) -> None:
    """Fill a page's tables with figures of campaigns."""
    from refseq.files import replace_text
    from refseq_bench.scenarios.campaign.pages.tables import CampaignRuns, blocks, replaced, selected_blocks, stale
    from refseq_bench.scenarios.campaign.store.result_file import read_result

    replacing, text = replacement(page, [page]), _text_of(page)
    wanted = selected_blocks(blocks(text, str(page)), table or (), str(page))
    changed = list(stale(wanted, CampaignRuns([read_result(folder) for folder in folders])))
    for block, _ in changed:
        say(out, f"{page}: table {block.name}: " + ("stands otherwise" if check else "filled"))
    say(out, f"{page}: {len(wanted) - len(changed)} of {len(wanted)} tables stood as they should")
    if check and changed:
        raise typer.Exit(FAILED)
    if changed and not check:
        with replacing, writing(page):
            replace_text(page, replaced(text, changed))


def _text_of(page: Path) -> str:
    try:
        return read_text(page)
    except TextFileError as error:
        raise ScenarioError(f"{page}: {error}; valid is a page in Markdown") from None


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario validity out/validity`
* `refseq scenario validity out/laser out/camera --page docs/validity.md --plots docs/images`

Cases real/NAME and twin/NAME of a scenario are a pair (docs/validity.md). Of a case that several campaigns ran the
later one named counts. On a page the lines between `<!-- validity -->` and `<!-- end validity -->` are replaced, but
for what they tell of other scenarios.""",
)
def validity(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER", help="Folders that `refseq scenario run` filled.")],
    page: Annotated[Path | None, option("FILE", "Page in Markdown to fill, instead of printing.")] = None,
    plots: Annotated[Path | None, option("FOLDER", "Folder for a plot of each scenario, SCENARIO.svg.")] = None,
) -> None:
    """Compare the order of methods on real sets with that on their simulated twins."""
    from refseq.files import replace_text
    from refseq_bench.scenarios.campaign.pages.validity import page_with, panels, report_of, validities
    from refseq_bench.scenarios.campaign.store.result_file import read_result

    replacing = nullcontext() if page is None else replacement(page, [page])
    text = None if page is None else _text_of(page)
    campaigns = [read_result(folder) for folder in folders]
    body = report_of(campaigns)
    if page is None or text is None:
        typer.echo(body, nl=False)
    else:
        with replacing, writing(page):
            replace_text(page, page_with(text, body, str(page)))
        say(out, f"{page}: filled")
    if plots is not None:
        from refseq_bench.scenarios.report.plots.order import real_over_twin

        check_folder(plots)
        with writing(plots):
            plots.mkdir(parents=True, exist_ok=True)
            for one in validities(campaigns, "success"):
                drawing = real_over_twin(panels(one), one.methods, "success")
                replace_text(plots / f"{one.scenario}.svg", drawing.standalone)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario run dials -j 2 -o out/dials`
* `refseq scenario curves out/dials -o dials.svg --methods best/chain,topometric`

Numbers stand where they belong on their axis, lights at their hours; texts that differ in one number, as
`building:SEED,texture=0.3`, at that number. Of a case that several campaigns ran the later one named counts.""",
)
def curves(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER", help="Folders that `refseq scenario run` filled.")],
    output: Annotated[Path, output_file(DRAWING, "Picture to write")] = Path("curves.svg"),
    methods: Annotated[str | None, option("NAMES", "Only these, commas between. [default: all that answered]")] = None,
) -> None:
    """Draw success over the one key that a scenario varies, a panel for each scenario."""
    from refseq.files import replace_text
    from refseq_bench.scenarios.campaign.store.result_file import read_result

    wanted, campaigns = words(methods, "--methods"), [read_result(folder) for folder in folders]

    from refseq_bench.scenarios.campaign.pages.sweep_plot import sweeps_of
    from refseq_bench.scenarios.report.plots.sweep import success_over_each

    sweeps = sweeps_of(campaigns, wanted or ())
    with writing(output):
        replace_text(output, success_over_each(sweeps).standalone)
    say(out, f"{output}: {plural(len(sweeps), 'curve')}")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq scenario template -o my_localiser.py`
* `refseq scenario run smoke --localiser my_localiser:MyLocaliser`
* `refseq scenario template -o my_localiser.cpp`
* `refseq scenario run smoke --localiser ./my_localiser`""",
)
def template(
    output: Annotated[Path, output("Python or C++ file to write (.py, .cpp).")] = Path("my_localiser.py"),
) -> None:
    """Write a small localiser that works, to begin one of your own with."""
    from refseq.files import replace_text
    from refseq_bench.scenarios.methods.templates import MY_LOCALISER

    if output.suffix not in MY_LOCALISER or not output.stem.isidentifier():
        raise ScenarioError(
            f"{output}: is no module's name; valid is a name that can be imported, ending in .py, or one ending in .cpp"
        )
    check_new(output)
    with writing(output):
        replace_text(output, MY_LOCALISER[output.suffix].read_text(encoding="utf-8"))
    say(out, f"{output} is written; run it from this folder: {_how_to_run(output)}")


def _how_to_run(template: Path) -> str:
    run = "refseq scenario run smoke --localiser"
    if template.suffix == ".py":
        return f"{run} {template.stem}:{TEMPLATE_CLASS}"
    return f"g++ -O2 -std=c++17 -o {template.stem} {template.name} && {run} ./{template.stem}"
