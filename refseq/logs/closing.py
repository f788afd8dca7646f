"""Writers that are closed at the end of a ``with`` block, whatever ended it."""

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self

from refseq.errors import LogError


class ClosedAtExit(ABC):
    """A writer whose file gets its name when the block ends."""

    @abstractmethod
    def close(self) -> None:
        """Finish the file and give it its name. Raises ``LogError``."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except LogError:
            if error is None:  # else what went wrong first is what tells why
                raise
