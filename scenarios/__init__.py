"""Experiments on place recognition: record, localise, score, judge, report.

    for result in run("smoke"):
        print(result.verdict, result.case.name)
    print(score(beliefs, recording, map).success)

``run`` runs declared scenarios, ``score`` judges what a localiser answered; the command line is ``refseq``. The names
below are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq_bench.scenarios.api import run, score
    from refseq_bench.scenarios.errors import ScenarioError, input_errors
    from refseq_bench.scenarios.scoring.path_geometry import Tolerance
    from refseq_bench.scenarios.scoring.score import Score

if __name__ != "refseq_bench.scenarios":
    # In a checkout the path leads here too, under a name by which all classes would be there twice.
    raise ImportError(f"{__name__!r} is imported as 'refseq_bench.scenarios'")

_HOMES = {
    "api": ("run", "score"),
    "errors": ("ScenarioError", "input_errors"),
    "scoring.path_geometry": ("Tolerance",),
    "scoring.score": ("Score",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = ["ScenarioError", "Score", "Tolerance", "input_errors", "run", "score"]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
