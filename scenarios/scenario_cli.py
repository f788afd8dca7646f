"""The commands ``refseq scenario list | show | run | report``."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.console import err, out, say

FAILED, BROKEN = 1, 2

scenario = typer.Typer(
    help="Declared experiments: what there is, what one declares, running them, their verdicts.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)

Names = Annotated[
    list[str], typer.Argument(metavar="SCENARIO...", help="Names, cases, or tags of the library, or paths (.toml).")
]


@scenario.command("list")
def list_scenarios() -> None:
    """List the scenarios of the library."""
    from scenarios.campaign.cases import find, names

    for name in names():
        say(out, f"{name}: {find([name])[0].scenario.title}")


@scenario.command()
def run(
    scenarios: Names,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder to fill.")] = Path(
        "out/campaign"
    ),
    workers: Annotated[int, typer.Option("--workers", "-j", min=1, metavar="N", help="Processes that work.")] = 1,
    cache: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where recordings and answers are kept. [default: the user's]")
    ] = None,
) -> None:
    """Run scenarios and judge them."""
    from scenarios.campaign.cases import find
    from scenarios.campaign.outcomes import Verdict
    from scenarios.campaign.run import Quiet, run_campaign
    from scenarios.campaign.store import Store, default_store
    from scenarios.campaign.workers import LocalWorkers

    cases = find(scenarios)
    store = Store(cache or default_store())
    executor = LocalWorkers(workers, store.folder)
    verdicts = set()
    try:
        for result in run_campaign(cases, executor, store, Quiet()):
            verdicts.add(result.verdict)
            say(out, f"{result.verdict.value}: {result.case.name}")
            for reason in result.reasons:
                say(err, f"  {reason}")
    except BaseException:
        executor.close(at_once=True)
        raise
    executor.close(at_once=False)
    if Verdict.ERROR in verdicts:
        raise typer.Exit(BROKEN)
    if Verdict.FAILED in verdicts:
        raise typer.Exit(FAILED)
