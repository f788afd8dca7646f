"""The slowest tests of a run as a table, for the summary that a CI server shows beside a run."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Protocol

COUNT = 10


class Report(Protocol):
    """Report by pytest of a test's phase: its name, and the seconds that it took."""

    nodeid: str
    duration: float


def slowest(reports: Iterable[Report], count: int = COUNT) -> str:
    """Table in Markdown of the tests that took longest, what they set up and took down for it included [s]."""
    seconds: dict[str, float] = defaultdict(float)
    for report in reports:
        seconds[report.nodeid] += report.duration
    first = sorted(seconds, key=lambda name: (-seconds[name], name))[:count]
    whole = sum(seconds.values())
    rows = [f"| {seconds[name]:.1f} | `{name}` |\n" for name in first]
    head = f"The slowest {len(first)} of {len(seconds)} tests, which together took {whole:.0f} s of one core:\n\n"
    return "".join([head, "| s | test |\n|---:|---|\n", *rows])
