"""Writers of drives that a ``with`` block closes; a drive that ended before its time is told from a whole one."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from refseq.planar import Pose
from refseq.view import View

COMPLETE, CAUSE, ENDED = "complete", "cause", "ended"
"""Notes in the metadata of a drive that ended before its time: ``False``, why, and when (UTC); a whole one has none."""
LONGEST_CAUSE = 200
"""Characters of a cause that are kept."""


class DriveWriter(ABC):
    """A drive that is being written: it gets its name when it is closed, as a ``with`` block that ends well does.

    When an error ends the block, what was written stays beside it, at ``partial``, marked as incomplete; what lay under
    the name stays as it was. The error's note tells so.
    """

    path: Path
    partial: Path
    """Where the drive lies while it is written: a new name."""
    written: int = 0
    """Views so far."""

    @abstractmethod
    def write(self, view: View, odometry: Pose) -> None:
        """Add a view, and the odometer's pose at it. Raises as ``writable`` does, and where it cannot be written."""

    @abstractmethod
    def note(self, metadata: Mapping[str, str]) -> None:
        """Add to what is told of the drive; of two values of a key the later one counts."""

    @abstractmethod
    def close(self) -> None:
        """Finish the drive and give it its name. Raises ``LogError``."""

    @abstractmethod
    def leave(self, notes: Mapping[str, str]) -> None:
        """Finish the drive where it lies, with ``notes``, as far as that can be."""

    @abstractmethod
    def discard(self) -> None:
        """Give the drive up: nothing of it stays, and what is at ``path`` stays as it was."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            try:
                self.close()
            except BaseException as failure:
                self._tell(failure)
                raise
        elif self.written:
            self.leave(early_end(error))
            self._tell(error)
        else:
            self.discard()

    def _tell(self, error: BaseException) -> None:
        if self.partial.exists():
            views = "1 view" if self.written == 1 else f"{self.written} views"
            stays = f"{self.path} stays as it was; " if self.path.exists() else ""
            error.add_note(f"{stays}{self.partial} holds {views}, incomplete: use it as it is, or record again")


def early_end(error: BaseException) -> dict[str, str]:
    """Notes for the metadata of a drive that an error ended before its time."""
    stopped = isinstance(error, KeyboardInterrupt)  # the command line takes SIGTERM for one as well
    cause = "interrupted" if stopped else str(error) or type(error).__name__
    return {**incomplete(cause), ENDED: f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"}


def incomplete(cause: str) -> dict[str, str]:
    """Notes for the metadata of a drive that is made of one that is not whole."""
    return {COMPLETE: "False", CAUSE: " ".join(cause.split())[:LONGEST_CAUSE]}


def noted_damage(metadata: Mapping[str, str]) -> str:
    """The reason why a drive is not complete, by the notes in its metadata; empty where it is."""
    if metadata.get(COMPLETE) != "False":
        return ""
    return ", ".join(filter(None, (metadata.get(CAUSE), metadata.get(ENDED)))) or "ended before its time"


class CuttableLog(ABC):
    """A log that may have been cut off, ``_cut`` says where, or be of a drive that ended before its time."""

    _cut: str

    @property
    @abstractmethod
    def metadata(self) -> Mapping[str, str]:
        """Notes of whoever wrote it."""

    @property
    def complete(self) -> bool:
        """False for a log that was cut off or is damaged, and for a drive that ended before its time."""
        return not self.damage

    @property
    def damage(self) -> str:
        """The reason why it is not complete; empty where it is."""
        return noted_damage(self.metadata) or self._cut
