"""Colours of a map's paths, and labels in its drawings."""

from collections.abc import Sequence

import rerun as rr

from refseq.viewer.drawing.colours import Colour

PATHS: Sequence[Colour] = (
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (200, 200, 200),
    (150, 110, 60),
    (86, 180, 233),
    (230, 159, 0),
)
"""Okabe and Ito's, those of the truth and the belief last; when they are used up they come again."""


def of_path(number: int) -> Colour:
    """The colour of a path by its number."""
    return PATHS[number % len(PATHS)]


def send_labels(
    stream: rr.RecordingStream, path: str, spots: Sequence[tuple[float, float]], labels: Sequence[str], colour: Colour
) -> None:
    """Words in a drawing that does not change; their size is that of the screen."""
    if spots:
        points = rr.Points2D(spots, labels=labels, show_labels=True, colors=colour, radii=-0.1)
        stream.log(path, points, static=True)
