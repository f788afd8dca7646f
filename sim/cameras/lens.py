"""A lens before a sensor: where a point is drawn, how much light gets there, how sharp it is.

Axes of a camera as OpenCV has them: x to the right, y down, z ahead; pixel (0, 0) is the centre of the top left one.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.device_tables import TABLE, Number, require, require_positive, require_share
from refseq_bench.sim.errors import SimError

Plane = NDArray[np.floating]
"""One number a pixel, or a point."""

STEEPEST = math.tan(math.radians(80.0))
"""Rays farther off the axis than 80 degrees are not looked at: a plane picture of them would be very large (choice)."""
NARROWEST = 1.0
"""Smallest field of view along a picture's longer side [deg]: below it a length is in another unit (choice)."""
MOST_STRETCH = 2.0
"""Greatest distance of a corner from the middle, over that without distortion: built lenses reach 1.2 (choice)."""
LEAST_F, MOST_F = 0.5, 64.0
"""F-numbers: 0.5 is the least that can be, beyond 64 is a pinhole (choice)."""
MOST_BLUR = 20.0
"""Widest σ of a point's image [pixels]: nothing is seen through a wider one (choice)."""
_RADII = 1 << 15
"""Steps from the axis to ``STEEPEST`` in which the distortion is tabled: interpolating in between errs by 1e-7."""


@dataclass(frozen=True, slots=True)
class Lens:
    """Figures of a lens; raises ``SimError`` for values that none could have.

    ``focal`` length [m]; ``f_number``; ``transmission`` in 0…1; ``k1`` and ``k2``, radial distortion as in OpenCV: a
    point at the tangent r off the axis is drawn at r (1 + k1 r² + k2 r⁴); ``corner_loss``: share of the light that the
    mount keeps from the corners, besides the natural loss; ``blur``: width σ of the image of a point, 0…20 [pixels].
    """

    __pydantic_config__ = TABLE
    focal: Number = 4.3e-3  # S
    f_number: Number = 2.0  # choice, as all below without a tag
    transmission: Number = 0.9
    k1: Number = 0.0
    k2: Number = 0.0
    corner_loss: Number = 0.0
    blur: Number = 0.5

    def __post_init__(self) -> None:
        require_positive("lens", focal=self.focal)
        require(LEAST_F <= self.f_number <= MOST_F, "lens.f_number", self.f_number, f">= {LEAST_F:g} and <= {MOST_F:g}")
        require_share("lens", transmission=self.transmission)
        require(math.isfinite(self.k1), "lens.k1", self.k1, "finite")
        require(math.isfinite(self.k2), "lens.k2", self.k2, "finite")
        require(0.0 <= self.corner_loss <= 1.0, "lens.corner_loss", self.corner_loss, ">= 0 and <= 1")
        require(0.0 <= self.blur <= MOST_BLUR, "lens.blur", self.blur, f">= 0 and <= {MOST_BLUR:g} pixels")

    @property
    def distorts(self) -> bool:
        """True if straight lines may be drawn bent."""
        return self.k1 != 0.0 or self.k2 != 0.0

    def drawn(self, r: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where a point at the tangent ``r`` off the axis is drawn, in focal lengths off the centre; shape as ``r``."""
        return r * (1.0 + r**2 * (self.k1 + r**2 * self.k2))

    def spread(self, r: NDArray[np.float64]) -> NDArray[np.float64]:
        """Area to which the distortion draws a small patch at ``r``, over what it would be without; shape as ``r``."""
        return (1.0 + r**2 * (self.k1 + r**2 * self.k2)) * (1.0 + r**2 * (3.0 * self.k1 + r**2 * 5.0 * self.k2))


class Pinhole(NamedTuple):
    """The undistorted picture that a lens' picture is made from: size [pixels] and vertical field of view [deg]."""

    width: int
    height: int
    fovy: float


class Optics:
    """A lens before a sensor of ``size`` (width, height) pixels of a pitch ``pixel`` [m].

    Raises ``SimError`` when the distortion draws no point in the picture's corners or one that belongs far inside, and
    for a field of view below ``NARROWEST``.
    """

    def __init__(self, lens: Lens, pixel: float, size: tuple[int, int]) -> None:
        self.lens, self.size = lens, size
        self.focal = lens.focal / pixel
        """Focal length [pixels]."""
        self._centre = ((size[0] - 1) / 2, (size[1] - 1) / 2)
        self._radii = self._table()
        self._check(pixel)

    def _check(self, pixel: float) -> None:
        """Raise ``SimError`` for a picture that no lens draws: figures in other units make such."""
        across = math.degrees(2.0 * math.atan(max(self.size) / 2.0 / self.focal))
        if across < NARROWEST:
            raise SimError(
                f"lens.focal = {self.lens.focal:g} and sensor.pixel = {pixel:g}, both in metres, give a field of view "
                f"of {across:.2g} degrees; valid is {NARROWEST:g} degree or more"
            )
        corner = math.hypot(*self.size) / 2 / self.focal
        stretch = corner / float(np.interp(corner, *self._radii))
        if stretch > MOST_STRETCH:
            raise SimError(
                f"lens: k1, k2 = {self.lens.k1:g}, {self.lens.k2:g} draw the corner {stretch:.2g} times as far out as "
                f"without; valid is up to {MOST_STRETCH:g} times"
            )

    def _table(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances from the centre at which points are drawn, in focal lengths, and tangents of their rays: (n,) each.

        Both rise. Beyond the last one the lens would draw a second picture over the first.
        """
        tangents = np.linspace(0.0, STEEPEST, _RADII)
        drawn = self.lens.drawn(tangents)
        falls = np.flatnonzero(np.diff(drawn) <= 0.0)
        end = falls[0] + 1 if falls.size else len(drawn)
        corner, reach = math.hypot(*self.size) / 2, drawn[end - 1] * self.focal
        if reach < corner:
            raise SimError(
                f"lens: focal, k1, k2 = {self.lens.focal}, {self.lens.k1}, {self.lens.k2} draw {reach:.0f} pixels "
                f"around the centre; the corner of {self.size[0]} × {self.size[1]} is at {corner:.0f}"
            )
        return drawn[:end], tangents[:end]

    def rays(self, u: NDArray[np.floating], v: NDArray[np.floating]) -> tuple[Plane, Plane]:
        """Tangents (x, y) of the rays that are drawn at the pixels (``u``, ``v``), shapes as those."""
        x, y = (u - self._centre[0]) / self.focal, (v - self._centre[1]) / self.focal
        if not self.lens.distorts:
            return x, y
        drawn = np.hypot(x, y)
        straight = np.interp(drawn, *self._radii) / np.maximum(drawn, np.finfo(float).tiny)
        return x * straight, y * straight

    def pixels(self, x: NDArray[np.floating], y: NDArray[np.floating]) -> tuple[Plane, Plane]:
        """Pixels (u, v) at which rays of the tangents (``x``, ``y``) are drawn, shapes as those.

        Rays beyond the reach of the distortion are drawn at its end.
        """
        if self.lens.distorts:
            r = np.hypot(x, y)
            within = np.minimum(r, self._radii[1][-1])
            bent = self.lens.drawn(within) / np.maximum(r, np.finfo(float).tiny)
            x, y = x * bent, y * bent
        return x * self.focal + self._centre[0], y * self.focal + self._centre[1]

    @cached_property
    def _rays_of_all(self) -> tuple[Plane, Plane]:
        """Tangents of every pixel's ray, (height, width) each."""
        return self.rays(*np.meshgrid(np.arange(self.size[0], dtype=float), np.arange(self.size[1], dtype=float)))

    @cached_property
    def pinhole(self) -> Pinhole:
        """The smallest undistorted picture that shows all, at the scale that the lens has in its centre."""
        width, height = self.size
        if self.lens.distorts:
            width, height = (1 + math.ceil(2.0 * self.focal * np.abs(side).max()) for side in self._rays_of_all)
        return Pinhole(width, height, math.degrees(2.0 * math.atan(height / 2.0 / self.focal)))

    @cached_property
    def _sources(self) -> NDArray[np.float32]:
        """Where in the pinhole's picture each pixel is taken from, (height, width, 2)."""
        x, y = self._rays_of_all
        centre_x, centre_y = (self.pinhole.width - 1) / 2, (self.pinhole.height - 1) / 2
        return np.dstack([x * self.focal + centre_x, y * self.focal + centre_y]).astype(np.float32)

    def draw(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distort a picture of the size of ``pinhole``; without distortion it is returned as it is."""
        if not self.lens.distorts:
            return picture
        # OpenCV's stubs know no map that is whole without a second one.
        return cv2.remap(picture, self._sources, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]

    @cached_property
    def shading(self) -> NDArray[np.float32]:
        """Share of the light on the axis that each pixel gets from an even scene, (height, width).

        cos⁴ of the angle between ray and axis (natural vignetting), over the area to which the distortion spreads it:
        a barrel gathers light at the edge. Times what the mount leaves: 1 − ``corner_loss`` · (distance from the
        centre / that of the corner)⁴, a choice.
        """
        r = np.hypot(*self._rays_of_all)
        natural = (1.0 + r**2) ** -2 / self.lens.spread(r)
        across, down = (np.arange(n) - (n - 1) / 2 for n in self.size)
        distance = np.hypot(across[None, :], down[:, None])
        mount = 1.0 - self.lens.corner_loss * (distance / distance.max()) ** 4
        return (natural * mount).astype(np.float32)

    def blurred(self, picture: NDArray[np.floating]) -> NDArray[np.float32]:
        """``picture`` as sharp as the lens is: each point a Gaussian of σ = ``blur`` pixels."""
        sharp = np.asarray(picture, np.float32)
        if self.lens.blur == 0.0:
            return sharp
        return cv2.GaussianBlur(sharp, (0, 0), self.lens.blur, borderType=cv2.BORDER_REPLICATE).astype(
            np.float32, copy=False
        )
