"""Short names for what the worlds are computed with."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Span = tuple[float, float]
"""From where to where along an axis, [m]."""
Block = tuple[Span, Span, Span]
"""A box in a frame: spans along it, out of it and up [m]."""
