from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.parts.facets import joined, quad, show
from refseq_bench.worlds.parts.site import Site

SLANTED = np.array([[0, 1, 0], [1, 1, 0], [1, 2, 1], [0, 2, 1]], float)
SKY = np.array([0.6, -0.64, 0.48])


def test_a_mirror_image_keeps_its_normals_and_faces_outwards() -> None:
    facets = replace(quad(SLANTED), normals=np.tile(SKY, (4, 1)))
    image = facets.mirrored()
    assert image.normals is not None
    np.testing.assert_array_equal(image.normals, np.tile(SKY * [1, -1, 1], (4, 1)))
    (a, b, c), (d, e, f) = facets.points[facets.triangles[0]], image.points[image.triangles[0]]
    np.testing.assert_array_equal(np.cross(e - d, f - d), np.cross(b - a, c - a) * [1, -1, 1])
    assert quad(SLANTED).mirrored().normals is None


def test_meshes_with_and_without_normals_are_not_put_together() -> None:
    bare, smooth = quad(SLANTED), replace(quad(SLANTED), normals=np.tile(SKY, (4, 1)))
    both = joined([smooth, smooth])
    assert both.normals is not None
    assert both.normals.shape == (8, 3)
    assert both.triangles.max() == 7
    assert joined([bare, bare]).normals is None
    for parts in ([bare, smooth], [smooth, bare]):
        with pytest.raises(ValueError, match=r"^1 of 2 meshes have normals; valid is all of them, or none$"):
            joined(parts)


def test_a_picture_stands_upright_on_its_mesh() -> None:
    """Its lower edge, at which MuJoCo counts 1, is at the lower corners: at z = 0."""
    site = Site("one", seed=0)
    show(site, "facet", quad(SLANTED), "", cast=False)
    model = site.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    places = model.mesh_vert @ data.geom("facet").xmat.reshape(3, 3).T + data.geom("facet").xpos
    up, on_picture = places[model.mesh_face.ravel(), 2], model.mesh_texcoord[model.mesh_facetexcoord.ravel(), 1]
    assert np.ptp(up) == pytest.approx(1.0)
    np.testing.assert_allclose(on_picture, 1.0 - up, atol=1e-6)
