"""A camera whose images are small squares, for learners: cheap to draw, as no large picture is drawn first."""

from dataclasses import replace

from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.errors import SimError

FEWEST = 16
"""The shortest side of an image [pixels]; a choice."""


def square_camera(model: CameraModel, side: int) -> CameraModel:
    """The camera with a square sensor of ``side`` × ``side`` pixels, as high as its own, behind the same lens.

    Each pixel stands for a square of its own sensor's, which are read as one: they gather and hold as much light
    together, and are read out once. So images show the middle of what the camera sees, at the same exposure. Raises
    ``SimError`` for a side that is no whole number from 16 to the sensor's height.
    """
    sensor, most = model.sensor, min(model.sensor.size)
    if isinstance(side, bool) or not isinstance(side, int) or not FEWEST <= side <= most:
        raise SimError(f"pixels = {side!r} is not valid: valid is a whole number from {FEWEST} to {most}")
    binned = sensor.size[1] / side
    square = replace(sensor, size=(side, side), pixel=sensor.pixel * binned, full_well=sensor.full_well * binned**2)
    return replace(model, sensor=square, lens=replace(model.lens, blur=model.lens.blur / binned))
