"""The one interface of all renderers: luminance [cd/m²] of every pixel that a camera sees."""

from collections.abc import Callable
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # the doctor looks at drivers also where MuJoCo cannot be imported
    import mujoco


class RendererKind(StrEnum):
    """The ways to draw that a user can ask for."""

    BAKED = "baked"
    FILAMENT = "filament"
    CLASSIC = "classic"
    NONE = "none"


DEFAULT_RENDERER = RendererKind.BAKED
"""The one where nobody chose: nearest to the light of a path tracer, and the cheapest but for the crude one."""

BY_OPENGL = (RendererKind.BAKED, RendererKind.CLASSIC)
"""Kinds that need the same driver: where one finds none, the other does not either."""


def others_than(*kinds: RendererKind) -> str:
    """All other kinds, as a message offers them: ``'filament' or 'none'``."""
    *more, last = (f"'{kind}'" for kind in RendererKind if kind not in kinds)
    return " or ".join([", ".join(more), last] if more else [last])


class Renderer(Protocol):
    """Draws what a model's cameras see."""

    kind: RendererKind

    def radiance(self, data: "mujoco.MjData", camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """Luminance [cd/m²] of each pixel, (height, width), a fresh array; the row 0 is the top one."""
        ...

    def light_around(self, illuminance: Callable[[], float]) -> None:
        """Let the light that comes from all sides alike give so much [lx] from the next picture on.

        A renderer that has no such light asks for none: it may take seconds to work out.
        """
        ...

    def close(self) -> None:
        """Give the device back; closing twice is fine, drawing afterwards is a ``RendererError``."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


class Closing:
    """Base of what holds a device: ``with`` closes it."""

    def close(self) -> None:
        """Nothing to give back."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
