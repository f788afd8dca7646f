from dataclasses import replace

import numpy as np

from refseq.viewer.scene import scene_of
from tests.support import CountedImages, corridor_drive


def test_one_picture_a_camera_is_asked_for() -> None:
    asked: list[str] = []
    drive = corridor_drive(np.random.default_rng(0), count=6, size=48)
    late = [replace(view, images={"forward": view.images["forward"]}) for view in drive[:2]] + drive[2:]
    scene = scene_of(replace(view, images=CountedImages(view.images, asked)) for view in late)
    assert asked == ["forward", "lateral"]
    assert scene.sizes == {"forward": (64, 48), "lateral": (64, 48)}
    assert scene.cameras == ("forward", "lateral")
    assert scene.count == 6
