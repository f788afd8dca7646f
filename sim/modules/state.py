"""A robot's state as JSON, to the last bit."""

import json
from dataclasses import asdict, dataclass, fields

import numpy as np

from refseq.modules.heads import MessageError, read_head
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.state import Motors, RobotState, Stop
from refseq_bench.sim.device_tables import TABLE


@dataclass(frozen=True, slots=True)
class StateHead:
    """A ``RobotState`` as a message tells it: its fields, each of its type, and no other."""

    __pydantic_config__ = TABLE
    time: float
    pose: PlanarPose
    distance: float
    twist: Twist
    stops: tuple[Stop, ...]
    motors: Motors
    mode: str
    pitch: float
    sonar: tuple[float, ...] | None


def state_bytes(state: RobotState) -> bytes:
    """A state in JSON."""
    told = asdict(state)
    told["motors"] = state.motors.value
    told["sonar"] = None if state.sonar is None else state.sonar.tolist()
    told["stops"] = [{**asdict(stop), "cause": stop.cause.value, "blocks": stop.blocks.value} for stop in state.stops]
    return json.dumps(told).encode()


def state_in(data: bytes | None) -> RobotState:
    """Read a state. Raises ``MessageError`` for what is none."""
    try:
        told = read_head(StateHead, data or b"")
    except RobotsError as error:
        raise MessageError(f"a message is no state of a robot: {error}") from error
    sonar = None if told.sonar is None else np.array(told.sonar, np.float64)
    return RobotState(**{one.name: getattr(told, one.name) for one in fields(told)} | {"sonar": sonar})
