"""How a task or a case ended: well, below what was expected, or because the bench broke."""

from dataclasses import dataclass
from enum import StrEnum

from scenarios.errors import ScenarioError


class Verdict(StrEnum):
    """What became of a case.

    A failure is the robot's or the localiser's: it got stuck, or an expectation was missed. An error is the bench's.
    """

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class TaskOutcome:
    """How a task ended, with a ``reason`` in one line where it is not ``PASSED``, and what it took [s].

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
        """Whether what depends on it can go on."""
        return self.verdict is Verdict.PASSED


def one_line(error: BaseException) -> str:
    """An error in one line: the bench's own as it is, the system's with the file, of others also the kind."""
    if isinstance(error, ScenarioError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
