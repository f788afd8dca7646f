"""Outcomes of tasks and verdicts of cases: passed, below what was expected, or no result."""

from dataclasses import dataclass
from enum import StrEnum

from refseq_bench.scenarios.errors import ScenarioError

VERDICTS = (
    "A failure is a result: the robot got stuck, a localiser took too long, or an expectation was missed. An error is "
    "none: the bench broke, or a localiser of one's own gave no valid answers."
)
"""Meaning of the two verdicts, in the same words on all pages."""


class Verdict(StrEnum):
    """Verdict of a case or a task; ``VERDICTS`` tells a failure from an error."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class TaskOutcome:
    """Outcome of a task, with a ``reason`` in one line where it is not ``PASSED``, and its duration ``seconds`` [s].

    ``details`` are the trace of an error. ``kept`` says that it had been done before. ``damaged`` is the key of a file
    in the store that could not be read.
    """

    verdict: Verdict
    reason: str = ""
    details: str = ""
    seconds: float = 0.0
    kept: bool = False
    damaged: str = ""

    @property
    def good(self) -> bool:
        """True where tasks that need this one can go on."""
        return self.verdict is Verdict.PASSED


def one_line(error: BaseException) -> str:
    """An error in one line: the bench's own as it is, the system's with the file, of others also the kind."""
    if isinstance(error, ScenarioError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
