"""Vertices of what moves, where its bodies are, in the light around them."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.rendering.baked.batch import LUX, NORMAL, PLACE, Batch
from refseq_bench.sim.rendering.baked.still_light import Probes, on_cards
from refseq_bench.sim.rendering.baked.triangles import Floats

REACH = 30.0
"""Things farther away from the camera than this [m] throw no shadow of the sun: a choice."""


def moved(batch: Batch, data: mujoco.MjData, probes: Probes) -> NDArray[np.float32]:
    """Return a batch's vertices, (m, 14), as its bodies stand."""
    vertices = batch.vertices.copy()
    for body in np.unique(batch.bodies):
        own = batch.bodies == body
        rotation, place = data.xmat[body].reshape(3, 3), data.xpos[body]
        normals = batch.vertices[own, NORMAL] @ rotation.T
        vertices[own, PLACE] = batch.vertices[own, PLACE] @ rotation.T + place
        vertices[own, NORMAL] = normals
        vertices[own, LUX] = on_cards(probes.at(place), normals)
    return vertices


def near(batch: Batch, vertices: NDArray[np.float32], eye: Floats) -> NDArray[np.float32]:
    """Places of what throws shadows within ``REACH`` of the camera, (n, 3) [m]."""
    places = vertices[batch.casters, PLACE]
    return places[np.linalg.norm(places - eye, axis=1) < REACH]
