"""One robot's drive: channels and messages in, beliefs out; nothing of sockets."""

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from refseq.belief import Stage
from refseq.errors import RefseqError
from refseq.logs.pairing.stream import STANDSTILL, ClockSetBackError, ViewStream, topics_for
from refseq.logs.source import NO_VALUE
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.serve.answers import BeliefAnswer, answer_to
from refseq.serve.channels import RobotChannel, robot_channel
from refseq.serve.protocol import MOST_CHANNELS, ClientChannel, FoxgloveProtocolError
from refseq.view import FASTEST, View

VAIN = f"tells nothing: what should be a pose is {NO_VALUE}"
"""Said of a message that comes to no sample."""

TOO_FAST = "the odometer moves faster than any robot: its poses jump, or are not in metres"
"""Said of a way between two views that no robot makes."""

SPACING = 0.85
"""Way from view to view where the map does not tell it [m]: that of the bench's own drives."""


@dataclass(frozen=True, slots=True)
class ServeOptions:
    """Settings by which a drive is localised.

    ``stage``, ``sensors`` and ``seed`` are those of ``Localiser``; ``distance`` [m] is the way from view to view, None:
    that of the map's places. ``names`` gives sensors their names, topic → sensor; ``odometry`` is a topic, ``leading``
    and ``tolerance`` [s] are those of ``PairingOptions``.
    """

    stage: Stage = Stage.CHAIN
    sensors: tuple[str, ...] | None = None
    seed: int = 1
    distance: float | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    odometry: str | None = None
    leading: str | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("distance", self.distance), ("tolerance", self.tolerance)):
            if value is not None and not 0 <= value < math.inf:
                raise RefseqError(f"{name} {value:g} is not valid; valid is a number of 0 or more")


def spacing(map_: Map) -> float:
    """Way from place to place [m], as the map's drives had it where they did not stand."""
    return map_.usual_step or SPACING


class RobotSession:
    """Localises one drive; a new one begins where the robot's clock goes back.

    ``notes`` are lines for the robot's owner, taken with ``told``.
    """

    def __init__(self, map_: Map, options: ServeOptions) -> None:
        self._map, self._options = map_, options
        self._localiser = Localiser(map_, stage=options.stage, sensors=options.sensors, seed=options.seed)
        self._sensors = frozenset(options.sensors or map_.sensors)
        if options.leading is not None and options.leading not in {*self._sensors, *options.names}:
            valid = ", ".join(sorted(self._sensors))
            raise RefseqError(f"leading sensor {options.leading!r} is none of the map; valid are {valid}")
        for topic, name in options.names.items():
            if name not in map_.sensors:
                valid = ", ".join(sorted(map_.sensors))
                raise RefseqError(f"topic {topic}: {name!r} is no sensor of the map; valid are {valid}")
        self._distance = spacing(map_) if options.distance is None else options.distance
        self._channels: dict[int, RobotChannel] = {}
        self._stream: ViewStream | None = None
        self._notes: list[str] = []
        self._losses: set[str] = set()
        self._silent: tuple[str, ...] = ()
        self._passed_over: set[int] = set()
        self._last = math.inf
        self.views = 0

    def advertise(self, channels: Iterable[ClientChannel]) -> None:
        """Take note of channels; those of other kinds are told in a note, and what comes on them is passed over.

        Raises ``FoxgloveProtocolError`` for more than a client may have.
        """
        for one in channels:
            if len(self._channels) >= MOST_CHANNELS and one.number not in self._channels:
                raise FoxgloveProtocolError(f"more than {MOST_CHANNELS} channels")
            try:
                channel = robot_channel(one)
            except FoxgloveProtocolError as error:
                self._notes.append(str(error))
                self._channels.pop(one.number, None)
                self._passed_over.add(one.number)
                continue
            self._passed_over.discard(one.number)
            self._note_twice(one)
            self._channels[one.number] = channel
            if self._stream is not None:
                self._notes.append(f"topic {one.topic}: told of after the first message; it is used in the next drive")

    def _note_twice(self, one: ClientChannel) -> None:
        """Note a channel that takes another's number or topic."""
        for number, there in self._channels.items():
            if number == one.number and there.topic != one.topic:
                self._notes.append(
                    f"channel {number}: advertised as {there.topic}, and now as {one.topic}, which counts"
                )
            if number != one.number and there.topic == one.topic:
                self._notes.append(
                    f"topic {one.topic}: channels {number} and {one.number} are both of it; both are read"
                )

    def unadvertise(self, numbers: Iterable[int]) -> None:
        """Forget channels."""
        for number in numbers:
            self._channels.pop(number, None)
            self._passed_over.discard(number)

    def take(self, number: int, data: bytes) -> list[BeliefAnswer]:
        """Take a message on a channel; gives the beliefs on the views that are whole now, most often none.

        Raises ``RefseqError`` for a message that is not what its channel says, and for topics that fit no map.
        """
        if number not in self._channels:
            if number not in self._passed_over:
                self._tell_once([f"channel {number}: it is not advertised; what comes on it is passed over"])
            return []
        channel = self._channels[number]
        sample = channel.read(data, time.time_ns())
        stream = self._stream = self._stream or self._opened()
        if sample is None:
            self._tell_once([f"topic {channel.topic}: a message {VAIN}"])
            return []
        left: list[BeliefAnswer] = []
        try:
            views = stream.take(sample)
        except ClockSetBackError as error:
            left = self.end()
            self._notes.append(f"{error}; a new drive begins")
            self.restart()
            before, stream = stream, self._opened()
            stream.mount_as(before)
            self._stream = stream
            views = stream.take(sample)
        self._tell_of_losses(stream)
        self._tell_of_clocks(stream)
        return [*left, *(self._answer(view) for view in views)]

    def _tell_of_losses(self, stream: ViewStream) -> None:
        """Note the pictures and the odometry that views lack, each once."""
        losses = [f"topic {topic}: {reason}; a view is without its picture" for topic, reason in stream.damaged.items()]
        if stream.without_odometry:
            losses.append("views are left out: the odometry does not reach their times")
        self._tell_once(losses)

    def _tell_of_clocks(self, stream: ViewStream) -> None:
        """Note sensors that are not waited for, each silence once and its end, and clocks that stand still."""
        self._notes += [
            f"topic {topic}: silent for {seconds:.0f} s; it is not waited for until it sends again"
            for topic, seconds in stream.silent.items()
            if topic not in self._silent
        ]
        back = [topic for topic in self._silent if topic not in stream.silent]
        self._notes += [f"topic {topic}: sends again, and is waited for" for topic in back]
        self._silent = tuple(stream.silent)
        self._tell_once(
            f"topic {topic}: {STANDSTILL} messages in a row have the stamp {stamp:.3f} s; valid is one a stamp"
            for topic, stamp in stream.standing.items()
        )

    def _tell_once(self, losses: Iterable[str]) -> None:
        new = [loss for loss in losses if loss not in self._losses]
        self._losses.update(new)
        self._notes += new

    def end(self) -> list[BeliefAnswer]:
        """Beliefs on the views of what is left."""
        if self._stream is None:
            return []
        views = self._stream.end()
        self._tell_of_losses(self._stream)
        return [self._answer(view) for view in views]

    def restart(self) -> None:
        """Forget the drive."""
        self._localiser.reset()
        self._stream, self._last, self.views = None, math.inf, 0
        self._losses.clear()
        self._silent = ()

    def told(self) -> list[str]:
        """Notes since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def _opened(self) -> ViewStream:
        options = self._options
        roles = {channel.topic: channel.role for channel in self._channels.values()}
        topics = topics_for(roles, self._sensors, options.names, options.odometry)
        named = ", ".join(f"{topic} as {sensor}" for topic, sensor in topics.sensors.items())
        if topics.odometry is None:
            self._notes.append(f"a drive begins: {named}; no odometry, every moment is a view")
        else:
            self._notes.append(f"a drive begins: {named}; a view each {self._distance:.2f} m by {topics.odometry}")
        return ViewStream(topics, self._distance, leading=options.leading, tolerance=options.tolerance)

    def _answer(self, view: View) -> BeliefAnswer:
        self._tell_of_units(view)
        belief = self._localiser.update(view)
        self.views += 1
        return answer_to(self._map, self.views - 1, view, belief)

    def _tell_of_units(self, view: View) -> None:
        """Note, once, an odometer by which the robot is faster than any."""
        seconds = view.time - self._last  # −∞ at a drive's first
        if view.has_odometry and seconds > 0 and abs(view.distance) > FASTEST * seconds:
            self._tell_once([TOO_FAST])
        self._last = view.time
