"""Open a renderer by its kind."""

from collections.abc import Callable

import mujoco

from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.baked.renderer import BakedRenderer
from refseq_bench.sim.rendering.baked.still_light import Bake
from refseq_bench.sim.rendering.classic import ClassicRenderer
from refseq_bench.sim.rendering.filament import FilamentRenderer
from refseq_bench.sim.rendering.null import NullRenderer
from refseq_bench.sim.rendering.renderer import Renderer, RendererKind


def open_renderer(kind: RendererKind | str, model: mujoco.MjModel, bake: Bake | None = None) -> Renderer:
    """The renderer of that kind for a compiled model; ``bake`` tells one that bakes the light of the model's world.

    Raises ``SimError`` for an unknown kind, ``RendererError`` where its driver is missing: no other one steps in.
    """
    try:
        asked = RendererKind(kind)
    except ValueError:
        valid = ", ".join(RendererKind)
        raise SimError(f"unknown renderer '{kind}': valid are {valid}") from None
    return BakedRenderer(model, bake) if asked is RendererKind.BAKED else _RENDERERS[asked](model)


_RENDERERS: dict[RendererKind, Callable[[mujoco.MjModel], Renderer]] = {
    RendererKind.FILAMENT: FilamentRenderer,
    RendererKind.CLASSIC: ClassicRenderer,
    RendererKind.NONE: NullRenderer,
}
