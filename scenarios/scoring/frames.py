"""Places by picture: positions on a line of reference pictures, a frame from each to the next."""

from dataclasses import dataclass

from refseq.planar import Pose


@dataclass(frozen=True, slots=True)
class FramePose(Pose):
    """A place on the line of reference pictures: ``x`` is the number of a picture, not metres.

    ``right`` are the only numbers of reference pictures that are right, where a ground truth lists them; None: all
    within the tolerance.
    """

    right: frozenset[int] | None = None
