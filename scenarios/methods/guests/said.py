"""Lines that a guest says on standard error: passed on up to a bound, and the last of them kept."""

import sys
from codecs import getincrementaldecoder

PASSED_ON, KEPT = 64_000, 4_000
"""Characters of a guest that are passed on to the bench's standard error, and last ones that are kept."""
ENOUGH = "(the localiser says more on standard error, which is not shown)\n"


def printable(text: str) -> str:
    """A text without what would steer a terminal."""
    return "".join(sign if sign.isprintable() or sign in "\n\t" else "\N{REPLACEMENT CHARACTER}" for sign in text)


class Said:
    """All that a guest has said: ``last`` is the end of it."""

    def __init__(self) -> None:
        self._decoder = getincrementaldecoder("utf-8")("replace")
        self._left, self.last = PASSED_ON, ""

    def hear(self, piece: bytes) -> None:
        """Take a piece of it."""
        if self._left <= 0:
            piece = piece[-4 * KEPT :]  # a flood costs little
        text = printable(self._decoder.decode(piece))
        self.last = (self.last + text)[-KEPT:]
        if text and self._left > 0:
            self._left -= len(text)
            sys.stderr.write(text if self._left > 0 else f"{text}\n{ENOUGH}")
            sys.stderr.flush()
