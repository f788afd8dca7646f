"""Messages between modules: named parts, of which ``head`` is ours and the others are Foxglove's, or beliefs in JSON.

``Step`` is the robot's journal: all that it sensed and was told, in the order in which it happened. Each other module's
state follows from it (the localiser's from the views), so that one that is started anew reads it again and is where the
one before was.
"""

import json
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from refseq.belief import Belief, PoseBeside, Timings, pose_beside
from refseq.errors import LogError, RefseqError
from refseq.fault import DeclaredFault, FaultKind
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.foxglove.outgoing import picture_message, scan_message, stamp_message
from refseq.missions.log import Touch
from refseq.modules.heads import MessageError, Parts, head_bytes, read_head
from refseq.serve.channels import robot_channel
from refseq.serve.protocol import ClientChannel, FoxgloveProtocolError
from refseq.view import LASER, Scan, View, facing

HEAD, STATE, BELIEF = "head", "state", "belief"
CAMERA = "camera/"
"""Begin of the names of pictures."""

STEPS, VIEWS, COMMANDS = "robot/steps", "robot/views", "control/commands"
BELIEFS, ORDERS = "localiser/beliefs", "mission/orders"
"""Topics; each has one module that publishes there."""


@dataclass(frozen=True, slots=True)
class Ended:
    """A behaviour has ended: the ``number`` of its execution, whether it was done, and why."""

    number: int
    finished: bool
    why: str


@dataclass(frozen=True, slots=True)
class Command:
    """The Control layer's answer to a step of a drive, by its number: how to move for a period.

    ``number`` and ``behaviour`` say what execution it belongs to; ``halt``: to none, the robot stands. ``scan`` turns
    the laser, and does not move it. ``over`` is how the mission ended.
    """

    drive: str
    answers: int
    linear: float = 0.0
    angular: float = 0.0
    halt: bool = False
    number: int = 0
    behaviour: str = ""
    ended: Ended | None = None
    scan: bool = False
    over: str = ""

    @property
    def steers(self) -> bool:
        """True where a behaviour ran for it."""
        return not (self.halt or self.scan or self.over)


@dataclass(frozen=True, slots=True)
class ScanGeometry:
    """Angles of a scan to the last bit [rad], and its range [m]; the ranges are in Foxglove's message."""

    start: float
    step: float
    max_range: float


@dataclass(frozen=True, slots=True)
class Step:
    """A control period has gone by: ``number`` in the ``drive``, from 0, at ``time`` [s], ``travelled`` [m] in all.

    ``clock`` is the time by the robot's own stamps [s]. ``command`` is the one that was carried out; ``held`` names the
    modules for which the robot stood instead. A ``view`` of this number was taken behind it. ``truth``, x, y [m] and
    heading [rad], is for drawing alone; ``robot`` is its name. ``touches`` are of things that were touched for the
    first time since the last step. The parts beside are the robot's state, the scan to steer by where there is a new
    one, and beliefs that have come since the last step. ``scan_due``: the scan is old.
    """

    drive: str
    number: int
    time: float
    clock: float
    travelled: float
    robot: str
    held: str = ""
    command: Command | None = None
    view: int | None = None
    scan: ScanGeometry | None = None
    scan_due: bool = False
    touches: tuple[Touch, ...] = ()
    truth: tuple[float, ...] = ()
    over: str = ""


@dataclass(frozen=True, slots=True)
class ViewHead:
    """A view: ``number`` in the ``drive``, from 0, and what is no sensor's."""

    drive: str
    number: int
    time: float
    distance: float
    turn: float
    has_odometry: bool
    scan: ScanGeometry | None = None


@dataclass(frozen=True, slots=True)
class BeliefHead:
    """A belief on a view of a drive."""

    drive: str
    view: int


@dataclass(frozen=True, slots=True)
class OrderHead:
    """The executor's answer to a step, by its number: execution ``number`` of ``behaviour``, or stand (``halt``).

    The rest is for those who watch: the status, the order in force, the position [m along the way], and the log.
    """

    drive: str
    answers: int
    number: int
    behaviour: str
    halt: bool
    over: str
    why: str
    status: str
    order: int
    along: float
    tasks: tuple[str, ...]
    log: tuple[str, ...]


def part(parts: Parts, name: str) -> bytes | None:
    """The first part of a name; None where there is none."""
    return next((data for known, data in parts if known == name), None)


def head_of(kind: type[Any], parts: Parts) -> Any:
    """The head of a message. Raises ``MessageError``."""
    return read_head(kind, part(parts, HEAD) or b"")


@dataclass(frozen=True, slots=True)
class SentScan:
    """A scan on its way: the angles that belong in the head, and the parts beside it; neither where there is none."""

    geometry: ScanGeometry | None = None
    parts: tuple[tuple[str, bytes], ...] = ()


def sent_scan(scan: Scan | None, time: float) -> SentScan:
    """A scan as Foxglove has it; none without beams.

    It is sent ``facing``, as it will be read: its ranges would belong to other angles than those of the head otherwise.
    """
    if scan is None or not len(scan.ranges):
        return SentScan()
    scan = facing(scan)
    message = scan_message(scan, stamp_message(time))
    return SentScan(ScanGeometry(scan.start, scan.step, scan.max_range), ((LASER, message.encode()),))


def scan_in(parts: Parts, geometry: ScanGeometry | None) -> Scan | None:
    """The scan of a message. Raises ``MessageError``, also where the ranges were not sent from these angles on."""
    data = part(parts, LASER)
    if data is None or geometry is None:
        return None
    found = _content(data, "LaserScan")
    if not abs(found.start - geometry.start) <= geometry.step / 2:
        raise MessageError(
            f"a scan starts at {geometry.start} rad with steps of {geometry.step} rad, and its ranges at {found.start} "
            "rad; valid is one start, and counter-clockwise"
        )
    return Scan(found.ranges, geometry.start, geometry.step, geometry.max_range)


def view_parts(drive: str, number: int, view: View) -> Parts:
    """A view as a message; its truth stays with the robot."""
    scan = sent_scan(view.scan, view.time)
    head = ViewHead(drive, number, view.time, view.distance, view.turn, view.has_odometry, scan.geometry)
    parts, stamp = [(HEAD, head_bytes(head))], stamp_message(view.time)
    for name, image in view.images.items():
        parts.append((CAMERA + name, picture_message(name, image, stamp).encode()))
    return [*parts, *scan.parts]


def view_in(head: ViewHead, parts: Parts) -> View:
    """The view of a message. Raises ``MessageError``."""
    images = {name.removeprefix(CAMERA): _picture(data) for name, data in parts if name.startswith(CAMERA)}
    return View(
        head.time,
        MappingProxyType(images),
        scan_in(parts, head.scan),
        head.distance,
        head.turn,
        has_odometry=head.has_odometry,
    )


@dataclass(frozen=True, slots=True)
class NumberedBelief:
    """A belief on a view of this number."""

    view: int
    belief: Belief


def belief_in(data: bytes) -> NumberedBelief:
    """A belief in the JSON of ``refseq.serve``. Raises ``MessageError``."""
    try:
        told = json.loads(data)
        view = int(told["view"])
        places = np.array(told["places"], dtype=np.float64)
        faults = tuple(DeclaredFault(**{**one, "kind": FaultKind(one["kind"])}) for one in told["faults"])
        belief = Belief(
            places,
            float(told["lost"]),
            int(told["best"]),
            tuple(int(place) for place in told["path"]),
            float(told["entropy"]),
            Timings(**told["timings"]),
            faults,
            None if told["lost_after"] is None else np.array(told["lost_after"], dtype=np.float64),
            None if told["beside"] is None else _pose_in(told["beside"]),
            float(told["odometer_scale"]),
        )
    except (ValueError, OverflowError, TypeError, KeyError, AttributeError, RecursionError, RefseqError) as error:
        raise MessageError(f"a message is no belief: {str(error)[:200]}") from error
    if places.ndim != 1 or not np.isfinite(places).all() or not 0 <= belief.best < len(places):
        raise MessageError(f"a belief of shape {places.shape} has its best place at {belief.best}")
    if not (0 <= belief.lost <= 1 and math.isfinite(belief.entropy)):
        raise MessageError(
            f"a belief has lost {belief.lost} and entropy {belief.entropy}; valid are 0 to 1, and finite"
        )
    if not 0 < belief.odometer_scale < math.inf:
        raise MessageError(f"a belief has odometer_scale {belief.odometer_scale}; valid is more than 0, and finite")
    if belief.lost_after is not None and belief.lost_after.shape != places.shape:
        raise MessageError(f"a belief of {len(places)} places has {belief.lost_after.shape} Lost_Places")
    return NumberedBelief(view, belief)


def _pose_in(told: Any) -> PoseBeside:
    return pose_beside([told["along"], told["aside"], told["heading"]], told["covariance"])


def _content(data: bytes, kind: str) -> Any:
    """The content of a message of Foxglove's."""
    try:
        sample = robot_channel(ClientChannel(0, kind, "protobuf", f"foxglove.{kind}")).read(data, 1)
    except FoxgloveProtocolError as error:
        raise MessageError(f"a message cannot be read: {error}") from error
    if sample is None:
        raise MessageError(f"a {kind} tells nothing")
    return sample.content


def _picture(data: bytes) -> Any:
    content = _content(data, "CompressedImage")
    assert isinstance(content, CompressedPicture)
    try:
        return content.decode()
    except LogError as error:
        raise MessageError(f"a picture cannot be read: {error}") from error
