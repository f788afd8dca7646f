"""What can become of one query view."""

from enum import StrEnum


class Outcome(StrEnum):
    """What became of one query view."""

    RIGHT = "right"
    WRONG = "wrong"
    MISSED = "missed"
    REJECTED = "rejected"
    FALSE_FIX = "false fix"
    UNSCORED = "without truth"


ON_MAP = (Outcome.RIGHT, Outcome.WRONG, Outcome.MISSED)
OFF_MAP = (Outcome.REJECTED, Outcome.FALSE_FIX)
SAYS_LOST = (Outcome.MISSED, Outcome.REJECTED)
