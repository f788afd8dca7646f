"""Lines that a guest says on standard error: passed on up to a bound, and the last of them kept."""

import sys
from codecs import getincrementaldecoder

PASSED_ON, KEPT = 64_000, 4_000
"""Characters of a guest that are passed on to the bench's standard error, and last ones that are kept."""
LONGEST = 4
"""Bytes of the longest character."""
ENOUGH = "(the localiser says more on standard error, which is not shown)\n"


def printable(text: str) -> str:
    """A text without what would steer a terminal."""
    return "".join(sign if sign.isprintable() or sign in "\n\t" else "\N{REPLACEMENT CHARACTER}" for sign in text)


class Said:
    """All that a guest has said; a flood costs little more than reading it."""

    def __init__(self) -> None:
        self._decoder = getincrementaldecoder("utf-8")("replace")
        self._left, self._end = PASSED_ON, b""

    def hear(self, piece: bytes) -> None:
        """Take a piece of it."""
        self._end = (self._end + piece)[-LONGEST * KEPT :]
        if self._left > 0 and (text := printable(self._decoder.decode(piece))):
            self._left -= len(text)
            sys.stderr.write(text if self._left > 0 else f"{text}\n{ENOUGH}")
            sys.stderr.flush()

    @property
    def last(self) -> str:
        """The end of it."""
        return printable(self._end.decode(errors="replace"))[-KEPT:]
