"""Drawn pictures: a patch of spots and strokes, warped into a picture that has others."""

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.scenes import Box, Scene
from refseq.view import View

WIDTH, HEIGHT = 640, 480
BOX = Box(220, 140, 200, 180)
CAMERA = "camera-1"


def picture(seed: int, width: int = WIDTH, height: int = HEIGHT) -> NDArray[np.uint8]:
    """A grey picture full of strokes and spots, another for each seed."""
    rng = np.random.default_rng(seed)
    made = np.full((height, width), 128, np.uint8)
    for _ in range(width * height // 1500):
        centre = (int(rng.integers(width)), int(rng.integers(height)))
        grey = int(rng.integers(256))
        if rng.random() < 0.5:
            cv2.circle(made, centre, int(rng.integers(3, 14)), grey, -1, cv2.LINE_AA)
        else:
            end = (centre[0] + int(rng.integers(-40, 40)), centre[1] + int(rng.integers(-40, 40)))
            cv2.line(made, centre, end, grey, int(rng.integers(1, 6)), cv2.LINE_AA)
    return np.asarray(cv2.GaussianBlur(made, (0, 0), 1.0), np.uint8)


def scene(seed: int = 1, box: Box = BOX) -> Scene:
    """A scene cut out of a picture."""
    patch = picture(seed)[box.y : box.y + box.height, box.x : box.x + box.width].copy()
    return Scene(patch, CAMERA, box, WIDTH, HEIGHT, "drawn.mcap", 12.5)


def view(image: NDArray[np.uint8], time: float = 0.0) -> View:
    """A view of one camera."""
    return View(time, {CAMERA: image})


def shown(one: Scene, homography: NDArray[np.float64], among: int, seed: int = 0) -> NDArray[np.uint8]:
    """A scene as it appears through a homography, before another picture, with a little noise."""
    whole = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    inside = np.s_[one.box.y : one.box.y + one.box.height, one.box.x : one.box.x + one.box.width]
    whole[inside], mask[inside] = one.patch, 255
    warped, where = (cv2.warpPerspective(part, homography, (WIDTH, HEIGHT)) for part in (whole, mask))
    noise = np.random.default_rng(seed).normal(0, 2, (HEIGHT, WIDTH))
    made = np.where(where > 127, warped, picture(among)) + noise
    return np.clip(made, 0, 255).astype(np.uint8)


def moved(
    shift: tuple[float, float, float], normal: tuple[float, float, float], distance: float
) -> NDArray[np.float64]:
    """The homography of a plane for a camera that is ``shift`` [m] (right, down, ahead) from where the scene was cut.

    X' = X − t, n · X = d: H = K (I − t nᵀ / d) K⁻¹ (Hartley and Zisserman, 13.1), with a focal length of 500 pixels.
    """
    k = np.array([[500.0, 0, WIDTH / 2], [0, 500.0, HEIGHT / 2], [0, 0, 1]])
    return k @ (np.eye(3) - np.outer(shift, normal) / distance) @ np.linalg.inv(k)
