"""The command ``refseq scenario search``."""

import shlex
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import (
    CACHE,
    CAMERA_RENDERER,
    CameraRenderer,
    option,
    output,
)
from refseq_bench.scenarios.drives.inputs import check_folder, writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from refseq_bench.scenarios.campaign.declare.case import Case
    from refseq_bench.scenarios.campaign.search.dials import Dial
    from refseq_bench.scenarios.campaign.search.search import SearchResult
    from refseq_bench.scenarios.campaign.search.seek import Prober

SEARCH_HELP = """Examples:

* `refseq scenario search dusk.toml --method best/chain --budget 40`
* `refseq scenario search light-dial/18:00 --method topometric --budget 30 --dial hour --dial people=0:0.5`

A point of the search is a reference and a query drive for each seed: with cameras 20 to 60 s of a core each, laser
alone a few seconds. The same command goes on where it was stopped, since nothing that is in the cache is done again.

A method fails where its success is below `--enough`. The worst point is then shrunk, dial by dial, to the smallest
change from the file at which it still fails; both are scenario files that `refseq scenario run` takes."""


def search(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A path (.toml), a name, or a single case.")],
    method: Annotated[str, option("NAME", "Method whose worst point is sought, as best/chain or topometric.")],
    budget: Annotated[
        int,
        option(
            "N", "Points to run, before shrinking; those where the robot gets stuck come on top.", min=1, max=10_000
        ),
    ],
    seed: Annotated[int, option("N", "Seed of the search.", min=0)] = 1,
    dial: Annotated[
        list[str] | None, option("NAME", "Turn only this dial, or NAME=FROM:TO; may be repeated. [default: all]")
    ] = None,
    enough: Annotated[float, option("PERCENT", "Success from which on the method passes.", min=1, max=100)] = 80.0,
    seeds: Annotated[str | None, option("N,N", "Seeds of the drives. [default: the scenario's first]")] = None,
    renderer: Annotated[CameraRenderer, CAMERA_RENDERER] = CameraRenderer.BAKED,
    workers: Annotated[int, option("N", "Processes on this machine.", "--workers", "-j", min=1)] = 1,
    cache: Annotated[Path | None, CACHE] = None,
    output: Annotated[Path, output("Folder for what is found.", "FOLDER")] = Path("out/search"),
) -> None:
    """Search a scenario's dials for the point at which a method fails, and the smallest change that does it."""
    check_folder(output)
    case = _easy_point(scenario, method, seeds, renderer)

    from refseq_bench.scenarios.campaign.search.dials import selected_dials
    from refseq_bench.scenarios.campaign.search.search import search as searched
    from refseq_bench.scenarios.campaign.search.search import write_search

    dials = selected_dials(case, dial or ())
    with _prober(case, dials, workers, cache) as probe:
        found = searched(probe, dials, budget, seed=seed, enough=enough / 100, say=lambda line: say(out, line))
    other = None if renderer is CameraRenderer.BAKED else renderer
    told = _as_typed(
        scenario, method=method, budget=budget, seed=seed, enough=f"{enough:g}", dial=dial, seeds=seeds or None,
        renderer=other,
    )  # fmt: skip
    with writing(output):
        files = write_search(found, case, dials, output, told=told, enough=enough / 100)
    _tell_found(found, files, enough)


@contextmanager
def _prober(case: "Case", dials: "Mapping[str, Dial]", workers: int, cache: Path | None) -> "Iterator[Prober]":
    """Runner of points of the search; its processes end with the block, at once where it was interrupted."""
    from refseq_bench.scenarios.campaign.run.workers import LocalWorkers
    from refseq_bench.scenarios.campaign.search.seek import Prober
    from refseq_bench.scenarios.campaign.store.cache import Store
    from refseq_bench.user_cache import user_cache

    store = Store(cache or user_cache())
    executor = LocalWorkers(workers, store.folder)
    at_once = True
    try:
        yield Prober(case, dials, executor, store)
        at_once = False
    finally:
        executor.close(at_once=at_once)


def _tell_found(found: "SearchResult", files: "Sequence[Path]", enough: float) -> None:
    """Print the worst point, the smallest change, and the files that were written."""
    from refseq_bench.scenarios.campaign.search.search import found_words

    say(out, f"worst, by the mean of both: {found_words(found.worst)}")
    if found.smallest is None:
        say(out, f"no point of {len(found.points)} below {enough:g} %")
    else:
        say(out, f"smallest change: {found_words(found.smallest)}")
    for file in files:
        say(out, f"{file} is written")


def _as_typed(scenario: str, **options: object) -> str:
    """The command that seeks this again, an option for each that is given, and for each entry of a list."""
    words = ["refseq", "scenario", "search", scenario]
    for name, given in options.items():
        for one in given if isinstance(given, list) else [given]:
            words += [] if one is None else [f"--{name}", str(one)]
    return shlex.join(words)


def _easy_point(scenario: str, method: str, seeds: str | None, renderer: CameraRenderer) -> "Case":
    """The one case that the search begins at, for one method. Raises ``ScenarioError`` where there are several."""
    from refseq_bench.scenarios.campaign.declare.cases import find
    from refseq_bench.scenarios.methods.names import written_out
    from refseq_bench.sim.rendering.renderer import RendererKind

    cases = find([scenario], rejudged=True)
    if len(cases) != 1:
        raise ScenarioError(f"{scenario}: makes {len(cases)} cases; valid is one, such as {cases[0].name}")
    if len(several := written_out((method,))) > 1:
        raise ScenarioError(f"--method {method}: stands for several; valid is one, such as {several[-1]}")

    from refseq_bench.scenarios.campaign.declare.overrides import with_methods, with_renderer, with_seeds

    cases = with_seeds(with_methods(cases, [method], ["none"]), seeds or str(cases[0].scenario.seeds[0]))
    (case,) = with_renderer(cases, RendererKind(renderer))
    return case
