"""Pictures as files, as small as they need be."""

from typing import Any

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from refseq.view import View
from refseq.viewer.drawing.jpeg import jpeg


def frame(view: View, camera: str) -> rr.EncodedImage | rr.Clear:
    """The picture of one camera; where the view has none, what was shown before is taken away."""
    image = view.images.get(camera)
    if image is None:
        return rr.Clear(recursive=False)
    return kept(jpeg(image))


def kept(content: bytes) -> rr.EncodedImage:
    """A picture that was kept as JPEG."""
    return rr.EncodedImage(contents=content, media_type="image/jpeg")


def drawing(pixels: NDArray[Any]) -> rr.EncodedImage:
    """A drawing, (h, w) grey or (h, w, 3) red, green and blue, without loss; its pixels stay sharp when it is large."""
    coloured = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR) if pixels.ndim == 3 else pixels
    _, data = cv2.imencode(".png", coloured, [cv2.IMWRITE_PNG_COMPRESSION, 3])
    return rr.EncodedImage(
        contents=data.tobytes(), media_type="image/png", magnification_filter=rr.components.MagnificationFilter.Nearest
    )


def inferno() -> NDArray[np.uint8]:
    """Colours from black over red to pale yellow for 0 to 255, (256, 3)."""
    ramp = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_INFERNO)
    return np.asarray(ramp[:, 0, ::-1], np.uint8)
