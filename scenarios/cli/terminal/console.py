"""Output of the commands: lines, tables, and results for other programs."""

import io
import json
import logging
import math
import os
import re
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console, ConsoleDimensions

from refseq.files import replacing_at
from refseq_bench.scenarios.drives.inputs import check_output, writing
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq_bench.scenarios.drives.evaluate import StageResult
    from refseq_bench.scenarios.scoring.comparison import Comparison
    from refseq_bench.scenarios.scoring.proportion import Proportion


class WideConsole(Console):
    """A console that breaks no line where nobody reads it in a window, piped or in a file, and cuts none anywhere.

    There ``COLUMNS`` sets another width, as on a terminal.
    """

    def print(self, *objects: Any, **how: Any) -> None:
        """Print what a window may be too narrow for: the terminal breaks such a line, and nothing of it is lost."""
        super().print(*objects, **{"crop": False, **how})

    def on_broken_pipe(self) -> None:
        """See rich, which ends the program with 1, a verdict."""
        raise BrokenPipeError

    @property
    def size(self) -> ConsoleDimensions:
        """Width and height [characters]."""
        if self.is_terminal or "COLUMNS" in os.environ:
            return super().size
        return ConsoleDimensions(PIPED_WIDTH, 25)

    @size.setter
    def size(self, new_size: tuple[int, int]) -> None:
        self._width, self._height = new_size


PIPED_WIDTH = 1000
"""Wider than any table of ours [characters]; tables are no wider than what they hold."""

out, err = WideConsole(), Console(stderr=True)

WITHOUT_TRUTH = (
    "jumps are steps that odometry does not allow, the slope is 1 for answers that go along with the robot, and others "
    "agree within 1.5 m along the map"
)
"""Explains the table of what needs no truth, in a line."""


class Notes(logging.Handler):
    """Print warnings of the library as notes."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        say(err, f"note: {record.getMessage()}")


OBEYED = re.compile("[\x7f-\x9f]")
"""Control characters that JSON takes for any other."""


def settle_terminal() -> None:
    """Decide what the terminal is told: notes of ours, and of the libraries' warnings nothing, unless Python is asked.

    ``PYTHONWARNINGS`` shows them, as ever; processes that we start follow. What a stream's encoding lacks is escaped,
    and a stream that was closed, as a service's may be, takes all and shows nothing.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - it stays open to the end
    logging.getLogger("refseq_bench.scenarios").handlers = [Notes()]
    logging.getLogger().addHandler(logging.NullHandler())  # otherwise Python prints what libraries log
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
        os.environ["PYTHONWARNINGS"] = "ignore"
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_json(value: object) -> None:
    """Print a value for other programs: dataclasses as tables, NaN and the like as null.

    JSON lets some control characters stand as they are, which a terminal would obey: they are written as their numbers.
    """
    text = json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False)
    print(OBEYED.sub(lambda sign: f"\\u{ord(sign[0]):04x}", text), file=out.file)


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: _plain(getattr(value, one.name)) for one in fields(value)}
    if hasattr(value, "model_dump"):
        return _plain(value.model_dump(mode="json"))
    if isinstance(value, Mapping):
        return {_key(key): _plain(one) for key, one in value.items()}
    if isinstance(value, str | Path):
        return str(value)
    if isinstance(value, Iterable):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _key(key: object) -> str:
    """A name in JSON: Python's own way of writing an object is none."""
    if not isinstance(key, str | int):
        raise TypeError(f"a key of JSON is text or a whole number, not {key!r}")
    return str(key)


@contextmanager
def saved(path: Path, about: str = "", *, quiet: bool = False) -> Iterator[Path]:
    """Write a file, the whole of it or nothing, under the name that is given here, and say so."""
    check_output(path)
    with writing(path), replacing_at(path) as temporary:
        yield temporary
    if not quiet:
        say(out, f"{path}: {about}" if about else f"{path}")


@contextmanager
def wrote(path: Path, *, quiet: bool = False) -> Iterator[None]:
    """Say that a file was written, or in one line what kept it from being."""
    with writing(path):
        yield
    if not quiet:
        say(out, f"{path}")


def print_results(title: str, found: "Sequence[StageResult]", comparisons: "Sequence[Comparison]") -> None:
    """The table of the stages, with the number of views and 95 % intervals."""
    from refseq_bench.scenarios.scoring.tables.score_tables import consistency_table
    from refseq_bench.scenarios.scoring.truth import truth_estimates, unscored_reason
    from refseq_bench.scenarios.tables import NONE, TextTable, plural

    views = sum(len(comparison.query_views) for comparison in comparisons)
    runs = f"{len(comparisons)} drives, " if len(comparisons) > 1 else ""
    tolerances = list(found[0].success) if found else []
    within = [f">within {tolerance.label} [95 %]" for tolerance in tolerances]
    table = TextTable("stage", *within, ">failures", ">lost", title=f"{title}: {runs}{plural(views, 'view')}")
    for result in found:
        shares = [share_of(result.success[tolerance]) for tolerance in tolerances]
        failures = NONE if result.failures is None else str(result.failures)
        table.add_row(result.stage.value, *shares, failures, str(result.lost))
    out.print(table)
    if unscored := unscored_reason(comparisons):
        out.print(consistency_table("stage", [(one.stage.value, one.consistency) for one in found]))
        say(out, f"not scored: {unscored}")
        say(out, WITHOUT_TRUTH)
    elif estimates := truth_estimates(comparisons):
        say(out, f"the truth is an estimate: {', '.join(estimates)}")
    if not unscored and found and not any(result.success[tolerances[0]].trials for result in found):
        say(out, "no view has a true pose on the map: nothing to score")


def share_of(share: "Proportion") -> str:
    """A share with the number of views."""
    return f"{share} of {share.trials}" if share.trials else str(share)


def leave_below(found: "Sequence[StageResult]", at_least: float | None) -> None:
    """Leave with 1 when the last stage is right less often than asked [%]."""
    leave_any_below({"": found}, at_least)


def leave_any_below(experiments: "Mapping[str, Sequence[StageResult]]", at_least: float | None) -> None:
    """Leave with 1 when the last stage of any of the named experiments is right less often than asked [%]."""
    last = {name: next(iter(found[-1].success.values())) for name, found in experiments.items() if found}
    below = {} if at_least is None else {name: one for name, one in last.items() if _is_below(one, at_least)}
    for name, success in below.items():
        where = f"{name}: " if name else ""
        say(err, f"{where}below what was asked: {share_of(success)}, at least {at_least:g} %")
    if below:
        raise typer.Exit(1)


def _is_below(success: "Proportion", at_least: float) -> bool:
    return not success.trials or 100 * success.value < at_least
