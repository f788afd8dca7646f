"""Positions by satellite in the plane: the transverse Mercator projection of a UTM zone."""

import numpy as np
from numpy.typing import NDArray

WGS84_A, WGS84_F = 6378137.0, 1 / 298.257223563
SCALE, FALSE_EASTING = 0.9996, 500000.0


def zone_of(longitude: float) -> int:
    """Number of the UTM zone of a longitude [°], from 1 to 60."""
    return int((longitude + 180) // 6) % 60 + 1


def utm(latitudes: NDArray[np.float64], longitudes: NDArray[np.float64], zone: int) -> NDArray[np.float64]:
    """Eastings and northings [m], (n, 2), of positions [°] in the coordinates of one zone.

    Krüger's series to the third order, exact to less than a millimetre within a zone's width. North of the equator and
    south of it northings are counted from the equator, so that a drive may cross it.
    """
    n = WGS84_F / (2 - WGS84_F)
    a = WGS84_A / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
    alpha = (n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16, 13 * n**2 / 48 - 3 * n**3 / 5, 61 * n**3 / 240)
    phi, lam = np.radians(latitudes), np.radians(longitudes - (6 * zone - 183))
    eccentricity = 2 * np.sqrt(n) / (1 + n)
    conformal = np.sinh(np.arctanh(np.sin(phi)) - eccentricity * np.arctanh(eccentricity * np.sin(phi)))
    xi, eta = np.arctan2(conformal, np.cos(lam)), np.arctanh(np.sin(lam) / np.sqrt(1 + conformal**2))
    waves = [(2 * j, factor) for j, factor in enumerate(alpha, start=1)]
    east = eta + sum(factor * np.cos(j * xi) * np.sinh(j * eta) for j, factor in waves)
    north = xi + sum(factor * np.sin(j * xi) * np.cosh(j * eta) for j, factor in waves)
    return np.stack([FALSE_EASTING + SCALE * a * east, SCALE * a * north], axis=-1)
