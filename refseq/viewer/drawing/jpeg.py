"""Pictures of cameras as JPEG, as small as they need be; whoever keeps some for later loads no viewer."""

import cv2
import numpy as np
from numpy.typing import NDArray

JPEG_QUALITY = 75


def jpeg(image: NDArray[np.uint8]) -> bytes:
    """A picture (h, w) as the content of a file."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()
