"""Facts about a robot's sensors that views do not tell."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from refseq.logs.source import CameraCalibration
from refseq.logs.transforms import Transform


@dataclass(frozen=True, slots=True)
class SensorRig:
    """Facts about sensors that views do not tell, by sensor's name: mounts on the robot, cameras' calibrations.

    Mounts are transforms from ``base_link``; those of cameras in ROS' optical axes, z forward and y down. The laser is
    turned as the robot is.
    """

    mounts: Mapping[str, Transform] = field(default_factory=dict)
    calibrations: Mapping[str, CameraCalibration] = field(default_factory=dict)
