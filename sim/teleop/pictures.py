"""Thumbnails of a view's images and scan for the page of captures."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan, View

SIZE = 256
"""Width of a scan's picture [px]; it is half as high."""
REACH = 8.0
"""Range of that picture ahead and to the sides [m]."""
DARK, BEAM, ROBOT = (24, 24, 28), (86, 180, 233), (230, 159, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture (height, width, 3), uint8, of a sensor by its name."""

    name: str
    pixels: NDArray[np.uint8]


def pictures_of(view: View) -> tuple[Picture, ...]:
    """A view's images, half as large; of one without images its scan."""
    images = [
        Picture(name, np.ascontiguousarray(np.repeat(image[::2, ::2, None], 3, axis=2)))
        for name, image in view.images.items()
    ]
    if not images and view.scan is not None:
        images.append(Picture("laser", scan_picture(view.scan)))
    return tuple(images)


def scan_picture(scan: Scan) -> NDArray[np.uint8]:
    """A scan from above, (SIZE / 2, SIZE, 3): the robot is at the bottom and looks up."""
    picture = np.full((SIZE // 2, SIZE, 3), DARK, np.uint8)
    scale = SIZE / (2 * REACH)
    with np.errstate(invalid="ignore"):  # beams without a range are nowhere
        rows = SIZE // 2 - 1 - np.round(scan.ranges * np.cos(scan.bearings) * scale)
        columns = SIZE // 2 - np.round(scan.ranges * np.sin(scan.bearings) * scale)
        inside = (rows >= 0) & (rows < SIZE // 2) & (columns >= 0) & (columns < SIZE)
    picture[rows[inside].astype(int), columns[inside].astype(int)] = BEAM
    picture[-4:, SIZE // 2 - 3 : SIZE // 2 + 4] = ROBOT
    return picture
