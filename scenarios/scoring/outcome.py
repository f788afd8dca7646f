"""Outcome of one query view: right, wrong, missed, rejected, false fix."""

from enum import StrEnum

from refseq.planar import Pose


class Outcome(StrEnum):
    """Outcome of one query view, on the map or off it."""

    RIGHT = "right"
    WRONG = "wrong"
    MISSED = "missed"
    REJECTED = "rejected"
    FALSE_FIX = "false fix"
    UNSCORED = "without truth"


ON_MAP = (Outcome.RIGHT, Outcome.WRONG, Outcome.MISSED)
OFF_MAP = (Outcome.REJECTED, Outcome.FALSE_FIX)
SAYS_LOST = (Outcome.MISSED, Outcome.REJECTED)


def judge(truth: Pose | None, on_map: bool, says_lost: bool, right: bool) -> Outcome:
    """Decide the outcome of one view."""
    if truth is None:
        return Outcome.UNSCORED
    if not on_map:
        return Outcome.REJECTED if says_lost else Outcome.FALSE_FIX
    if says_lost:
        return Outcome.MISSED
    return Outcome.RIGHT if right else Outcome.WRONG
