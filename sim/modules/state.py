"""A robot's state as JSON, to the last bit."""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from refseq.modules.heads import MessageError
from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.state import Blocked, Cause, Motors, RobotState, Stop


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
        told = json.loads(data or b"")
        return RobotState(
            **{
                **told,
                "pose": PlanarPose(**told["pose"]),
                "twist": Twist(**told["twist"]),
                "stops": tuple(_stop(one) for one in told["stops"]),
                "motors": Motors(told["motors"]),
                "sonar": None if told["sonar"] is None else np.array(told["sonar"], dtype=np.float64),
            }
        )
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise MessageError(f"a message is no state of a robot: {str(error)[:200]}") from error


def _stop(told: Any) -> Stop:
    return Stop(**{**told, "cause": Cause(told["cause"]), "blocks": Blocked(told["blocks"])})
