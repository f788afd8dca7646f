"""Noise of a picture, read off the picture itself."""

import numpy as np
from numpy.typing import NDArray

STEP = 4
"""Every so many columns and rows are looked at: some twenty thousand pixels of a VGA picture are enough."""
OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
OF_MASK = 6.0
"""Root of the sum of the mask's squares: its answer to noise of deviation 1."""


def picture_noise(image: NDArray[np.uint8]) -> float:
    """Deviation of a picture's noise [grey levels].

    By the mask of Immerkær, which cancels slopes and edges along rows and columns (Computer Vision and Image
    Understanding 64, 1996), and the median, which texture moves less than the mean. 0 for a picture smaller than 3 × 3.
    """
    rows, columns = image.shape[0] - 2, image.shape[1] - 2
    if rows < 1 or columns < 1:
        return 0.0

    def beside(down: int, right: int) -> NDArray[np.int16]:
        return image[down : down + rows : STEP, right : right + columns : STEP].astype(np.int16)

    corners = beside(0, 0) + beside(0, 2) + beside(2, 0) + beside(2, 2)
    sides = beside(0, 1) + beside(1, 0) + beside(1, 2) + beside(2, 1)
    return float(np.median(np.abs(corners - 2 * sides + 4 * beside(1, 1)))) / (OF_NORMAL * OF_MASK)
