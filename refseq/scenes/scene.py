"""Scene: a patch of a camera's picture, and where it was in it; a whole picture stands for the place itself."""

import hashlib
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.errors import SceneError
from refseq.view import View


class Box(NamedTuple):
    """A rectangle of a picture [pixels]: its upper left corner, width and height."""

    x: int
    y: int
    width: int
    height: int

    def __str__(self) -> str:
        return ",".join(map(str, self))

    @property
    def corners(self) -> NDArray[np.float64]:
        """Its corners (4, 2), clockwise from the upper left one."""
        right, below = self.x + self.width, self.y + self.height
        return np.array([(self.x, self.y), (right, self.y), (right, below), (self.x, below)], float)

    def is_in(self, width: int, height: int) -> bool:
        """True where it has an area, all of it in a picture of this size."""
        right, below = self.x + self.width, self.y + self.height
        return 0 <= self.x < right <= width and 0 <= self.y < below <= height


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Scene:
    """A ``patch`` (h, w) uint8, cut at a ``box`` of a picture of ``camera`` that was ``width`` × ``height`` pixels.

    ``drive`` names the recording that it was cut from, ``along`` [m] from that one's start; both are for people.
    """

    patch: NDArray[np.uint8]
    camera: str
    box: Box
    width: int
    height: int
    drive: str = ""
    along: float = 0.0

    def __repr__(self) -> str:
        """All that makes it, the patch by its digest: results of missions are kept under this text."""
        patch = hashlib.sha256(self.patch.tobytes()).hexdigest()
        size = f"width={self.width}, height={self.height}"
        return f"Scene({patch}, {self.camera!r}, {self.box}, {size}, {self.drive!r}, {self.along!r})"

    def check_camera(self, view: View) -> None:
        """Raise ``SceneError`` for views that lack the scene's camera, or have it with pictures of another size."""
        if self.camera not in view.images:
            cameras = ", ".join(view.images) or "none"
            raise SceneError(f"the scene is of {self.camera!r}, which is not there; cameras there are {cameras}")
        height, width = view.images[self.camera].shape
        if (width, height) != (self.width, self.height):
            ours = f"{self.width} × {self.height} pixels"
            raise SceneError(f"the scene is of pictures of {ours}; those of {self.camera!r} have {width} × {height}")


def cut_scene(view: View, camera: str, box: Box | None = None, *, drive: str = "", along: float = 0.0) -> Scene:
    """Cut a scene out of a view's picture; without a box it is the whole. Raises ``SceneError``."""
    if camera not in view.images:
        cameras = ", ".join(view.images) or "none"
        raise SceneError(f"camera {camera!r} is not in the view; valid are {cameras}")
    image = view.images[camera]
    height, width = image.shape
    box = box or Box(0, 0, width, height)
    if not box.is_in(width, height):
        raise SceneError(f"box {box} is not in the picture; valid is x,y,width,height within {width} × {height} pixels")
    patch = np.ascontiguousarray(image[box.y : box.y + box.height, box.x : box.x + box.width])
    return Scene(patch, camera, box, width, height, drive, along)
