"""Beliefs as messages: all of one in JSON, and its pose for viewers."""

import base64
import json
from dataclasses import asdict, dataclass

from foxglove import messages

from refseq.belief import Belief, BeliefMode, PoseBeside, Timings
from refseq.fault import FaultKind
from refseq.logs.foxglove.outgoing import nanoseconds_of, pose_message, stamp_message
from refseq.map.map import Map
from refseq.planar import Pose
from refseq.serve.protocol import ServerChannel
from refseq.view import View

FRAME = "map"
"""Frame that poses are in: that of the map's places."""

NUMBER, WHOLE, TEXT = {"type": "number"}, {"type": "integer"}, {"type": "string"}
SCHEMA = {
    "title": "refseq.Belief",
    "type": "object",
    "properties": {
        "view": WHOLE | {"description": "number of the view in this drive, from 0"},
        "time": NUMBER | {"description": "the view's time by the robot's stamps [s]"},
        "distance": NUMBER | {"description": "way by odometry since the view before [m]"},
        "turn": NUMBER | {"description": "turn by odometry since the view before [rad]"},
        "sensors": {"type": "array", "items": {"type": "string"}, "description": "sensors in the view"},
        "best": WHOLE | {"description": "the most probable place"},
        "probability": NUMBER | {"description": "its probability, if the robot is on the map"},
        "lost": NUMBER | {"description": "probability that the robot is not on the map"},
        "lost_after": {
            "type": ["array", "null"],
            "items": NUMBER,
            "description": "probability that it got lost behind each place; the rest of lost: nowhere known",
        },
        "last_sure": {
            "type": ["integer", "null"],
            "description": "place behind which it got lost; null: not lost, or unknown",
        },
        "modes": {
            "type": "array",
            "description": "stretches of places that it may be on, the most probable first; several: places look alike",
            "items": {
                "type": "object",
                "properties": {
                    "best": WHOLE | {"description": "the most probable place of the stretch"},
                    "probability": NUMBER | {"description": "that of all its places, if the robot is on the map"},
                },
            },
        },
        "entropy": NUMBER | {"description": "entropy of the places [nats]"},
        "path": {"type": "array", "items": WHOLE, "description": "best places of the last views; -1: lost"},
        "places": {"type": "array", "items": NUMBER, "description": "probability of each place"},
        "pose": {
            "type": ["object", "null"],
            "description": "pose in the map's frame [m, rad], beside the best place if known; null: lost, or no frame",
            "properties": {"x": NUMBER, "y": NUMBER, "heading": NUMBER},
        },
        "beside": {
            "type": ["object", "null"],
            "description": "the robot as seen from the best place, by its scan: ahead, to the left [m], turned [rad], "
            "their covariance row by row; null: nothing tells",
            "properties": {
                **dict.fromkeys(("along", "aside", "heading"), NUMBER),
                "covariance": {"type": "array", "items": NUMBER},
            },
        },
        "odometer_scale": NUMBER | {"description": "metres of the map that one of the odometer was taken for"},
        "faults": {
            "type": "array",
            "description": "faults of sensors that stand; what they make useless had no part in the belief",
            "items": {
                "type": "object",
                "properties": {
                    "sensor": TEXT,
                    "kind": TEXT | {"enum": list(FaultKind)},
                    "since": WHOLE | {"description": "number of the view since when"},
                    "time": NUMBER | {"description": "its time [s]"},
                    "evidence": NUMBER | {"description": "log-likelihood ratio to health [nats]"},
                },
            },
        },
        "timings": {
            "type": "object",
            "description": "wall time by step [s]",
            "properties": dict.fromkeys(asdict(Timings()), NUMBER),
        },
    },
}
BELIEF = ServerChannel(1, "/belief", "json", "refseq.Belief", json.dumps(SCHEMA), "jsonschema")
_POSE = messages.PoseInFrame.get_schema()
POSE = ServerChannel(2, "/belief_pose", "protobuf", _POSE.name, base64.b64encode(_POSE.data).decode(), "protobuf")
CHANNELS = (BELIEF, POSE)


@dataclass(frozen=True, slots=True)
class BeliefAnswer:
    """The belief on a view of a drive, its modes, and its pose in the map's frame where there is one."""

    number: int
    view: View
    belief: Belief
    pose: Pose | None
    modes: tuple[BeliefMode, ...]

    @property
    def nanoseconds(self) -> int:
        """The view's time [ns]."""
        return nanoseconds_of(self.view.time)

    @property
    def json(self) -> bytes:
        """The message on ``BELIEF``; numbers read back are the same to the last bit."""
        belief = self.belief
        told = {
            "view": self.number,
            "time": self.view.time,
            "distance": self.view.distance,
            "turn": self.view.turn,
            "sensors": sorted(self.view.sensors),
            "best": belief.best,
            "probability": float(belief.places[belief.best]),
            "lost": belief.lost,
            "lost_after": None if belief.lost_after is None else belief.lost_after.tolist(),
            "last_sure": belief.last_sure,
            "modes": [mode._asdict() for mode in self.modes],
            "entropy": belief.entropy,
            "path": list(belief.path),
            "places": belief.places.tolist(),
            "pose": None if self.pose is None else asdict(self.pose),
            "beside": None if belief.pose is None else _beside(belief.pose),
            "odometer_scale": belief.odometer_scale,
            "faults": [asdict(fault) for fault in belief.faults],
            "timings": asdict(belief.timings),
        }
        return json.dumps(told, allow_nan=False).encode()

    @property
    def pose_message(self) -> bytes | None:
        """The message on ``POSE``."""
        if self.pose is None:
            return None
        return messages.PoseInFrame(
            timestamp=stamp_message(self.view.time), frame_id=FRAME, pose=pose_message(self.pose)
        ).encode()


def _beside(pose: PoseBeside) -> dict[str, object]:
    told = dict(zip(("along", "aside", "heading"), pose.motion, strict=True))
    return {**told, "covariance": pose.covariance.ravel().tolist()}


def answer_to(map_: Map, number: int, view: View, belief: Belief) -> BeliefAnswer:
    """Put an answer together."""
    return BeliefAnswer(number, view, belief, map_.pose(belief), belief.modes_in(map_.first))
