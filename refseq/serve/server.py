"""The server: one robot publishes, anybody who may connect listens.

Everything is bounded: connections, a message's size, messages that wait to be read (the robot's ``send`` then waits
too), messages that wait to be sent to a listener (of which the oldest go). No page in a browser gets in without the
token.
"""

import asyncio
import http
import logging
import secrets
import signal
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from refseq.access.listener import BoundedListener, listening
from refseq.access.policy import AccessPolicy
from refseq.errors import RefseqError
from refseq.map.map import Map
from refseq.serve.answers import BELIEF, CHANNELS, BeliefAnswer
from refseq.serve.protocol import (
    OPS,
    SUBPROTOCOLS,
    Advertise,
    FoxgloveProtocolError,
    Message,
    StatusLevel,
    Subscribe,
    Unadvertise,
    Unserved,
    Unsubscribe,
    advertise,
    message_data,
    read_frame,
    server_info,
    status,
)
from refseq.serve.session import RobotSession, ServeOptions

MOST_CONNECTIONS = 16
"""Connections at a time; further ones are refused."""
MOST_BYTES = 1 << 25
"""The largest message that is taken, 32 MiB: a picture of 11 million raw pixels in colour."""
WAITING = 8
"""Messages of a robot that wait to be read; then its line is."""
OUTBOX = 64
"""Messages that wait for a listener who is slow; of more the oldest go."""
MOST_SOCKETS = 4 * MOST_CONNECTIONS
"""Sockets at a time, with those that have not said yet what they want; on further ones is hung up."""
PATIENCE = 5.0
"""Seconds in which a request has to be here whole."""
FAREWELL = 0.3
"""Seconds in which a connection may say goodbye when the server ends."""
BUSY, WRONG, FAULT = 1013, 1008, 1011
"""Codes with which a connection is closed: a robot is there already; what it sends is no protocol; a fault of ours."""

QUIET = logging.getLogger("refseq.serve")
"""Nothing that strangers send is worth a line."""
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False


def _subprotocol(_: ServerConnection, offered: Sequence[Subprotocol]) -> Subprotocol | None:
    """The newest that is offered; plain programs offer none."""
    return next((Subprotocol(name) for name in SUBPROTOCOLS if name in offered), None)


@dataclass(eq=False)
class _Listener:
    """A connection, its subscriptions (number → channel), what waits to be sent, and what it was warned of."""

    connection: ServerConnection
    subscriptions: dict[int, int] = field(default_factory=dict)
    outbox: "asyncio.Queue[str | bytes]" = field(default_factory=lambda: asyncio.Queue(OUTBOX))
    warned: set[str] = field(default_factory=set)

    def post(self, frame: str | bytes) -> None:
        """Have a frame sent; of too many the oldest goes."""
        if self.outbox.full():
            self.outbox.get_nowait()
        self.outbox.put_nowait(frame)

    def warn(self, line: str) -> None:
        """Tell the connection alone of something that is passed over, each once."""
        if line not in self.warned and len(self.warned) < OUTBOX:
            self.warned.add(line)
            self.post(status(StatusLevel.WARNING, line))

    async def send(self) -> None:
        """Send what waits, until the connection ends."""
        with suppress(ConnectionClosed):
            while True:
                await self.connection.send(await self.outbox.get())


class BeliefServer:
    """Serves a map: ``told`` is called with a line whenever there is news for who reads along."""

    def __init__(self, map_: Map, options: ServeOptions, access: AccessPolicy, told: Callable[[str], None]) -> None:
        self._map, self._options, self._access, self._told = map_, options, access, told
        self._name, self._session_id = "refseq", secrets.token_hex(8)
        self._listeners: set[_Listener] = set()
        self._robot: _Listener | None = None
        self._session = RobotSession(map_, options)
        self._localising = asyncio.Lock()
        self.views = self.drives = 0

    async def run(self, opened: Callable[[str], None]) -> None:
        """Serve until SIGINT or SIGTERM; ``opened`` is called with the address. Raises ``RefseqError``."""
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                loop.add_signal_handler(number, ended.set)
        async with self._serving(listening(self._access.host, self._access.port, MOST_SOCKETS)) as server:
            opened(self.address(server))
            await ended.wait()

    def _serving(self, listener: BoundedListener) -> Any:
        return serve(
            self._serve,
            sock=listener,
            process_request=self._checked,
            subprotocols=[Subprotocol(name) for name in SUBPROTOCOLS],
            select_subprotocol=_subprotocol,
            compression=None,  # pictures do not shrink, and nothing unpacks to more than was sent
            max_size=MOST_BYTES,
            max_queue=WAITING,
            open_timeout=PATIENCE,
            logger=QUIET,
            close_timeout=FAREWELL,
        )

    def address(self, server: Server) -> str:
        """The address to connect to."""
        port = next(iter(server.sockets)).getsockname()[1]
        return f"ws://{self._access.authority(port)}/{self._access.token}"

    def _checked(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a request that may not come in, before it is a connection."""
        headers = request.headers
        given = urlsplit(request.path).path.strip("/"), *headers.get_all("Authorization")
        reason = self._access.reason_against(
            headers.get_all("Host"),
            headers.get_all("Origin"),
            [one.removeprefix("Bearer ").strip() for one in given],
        )
        if reason:
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"{reason}\n")
        if len(self._listeners) >= MOST_CONNECTIONS:
            return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_CONNECTIONS} are connected\n")
        return None

    async def _serve(self, connection: ServerConnection) -> None:
        """Serve one connection from its first frame to its last."""
        listener = _Listener(connection)
        self._listeners.add(listener)
        listener.post(server_info(self._name, self._session_id))
        listener.post(advertise(CHANNELS))
        sending = asyncio.create_task(listener.send())
        try:
            async for frame in connection:
                await self._take(listener, frame)
        except ConnectionClosed:
            pass
        except RefseqError as error:
            await self._refuse(listener, WRONG, str(error))
        except Exception:
            # A fault of this program ends the connection that met it, not the server, and is told whole.
            self._told(traceback.format_exc())
            await self._refuse(listener, FAULT, "a fault of the server")
        finally:
            sending.cancel()
            self._listeners.discard(listener)
            if listener is self._robot:
                await self._left()

    async def _refuse(self, listener: _Listener, code: int, reason: str) -> None:
        self._told(f"a connection is closed: {reason}")
        if listener is self._robot:  # one that comes back at once is not refused for its own sake
            await self._left()
        with suppress(ConnectionClosed):
            await listener.connection.send(status(StatusLevel.ERROR, reason))
            await listener.connection.close(code, reason.encode()[:120].decode(errors="ignore"))

    async def _take(self, listener: _Listener, frame: str | bytes) -> None:
        """Do what a frame asks for. Raises ``RefseqError`` for one that nothing can be made of."""
        match read_frame(frame):
            case Subscribe(subscriptions):
                known = {channel.number: channel.topic for channel in CHANNELS}
                listener.subscriptions |= {number: channel for number, channel in subscriptions if channel in known}
                for _, channel in subscriptions:
                    if channel not in known:
                        valid = ", ".join(f"{one} ({topic})" for one, topic in known.items())
                        listener.warn(f"subscription to channel {channel}: there is none; valid are {valid}")
                if len(listener.subscriptions) > OUTBOX:
                    raise FoxgloveProtocolError(f"more than {OUTBOX} subscriptions")
            case Unsubscribe(numbers):
                for number in numbers:
                    listener.subscriptions.pop(number, None)
            case Advertise(channels):
                if self._robot not in (None, listener):
                    await self._refuse(listener, BUSY, "a robot is connected already; valid is one at a time")
                    return
                self._robot = listener
                self._session.advertise(channels)
                self._tell()
            case Unadvertise(numbers) if listener is self._robot:
                self._session.unadvertise(numbers)
            case Message(number, data) if listener is self._robot:
                await self._localise(lambda: self._session.take(number, data))
            case Message(number):
                listener.warn(f"channel {number}: a message before channels are advertised is passed over")
            case Unserved(op):
                listener.warn(f"op {op}: is not served; valid are {', '.join(OPS)}")

    async def _localise(self, work: Callable[[], Sequence[BeliefAnswer]]) -> None:
        """Work beside the loop, so that others are served meanwhile; the robot is read on when it is done."""
        async with self._localising:
            answers = await asyncio.to_thread(work)
        self._tell()
        for answer in answers:
            self.views += 1
            self.drives += answer.number == 0
            self._publish(answer)

    def _publish(self, answer: BeliefAnswer) -> None:
        made: dict[int, bytes | None] = {}  # of a large map they take milliseconds, and mostly nobody listens
        for listener in self._listeners:
            for subscription, channel in listener.subscriptions.items():
                if channel not in made:
                    made[channel] = answer.json if channel == BELIEF.number else answer.pose_message
                if (message := made[channel]) is not None:
                    listener.post(message_data(subscription, answer.nanoseconds, message))

    def _tell(self) -> None:
        """Tell news of the drive here and to all who listen."""
        for line in self._session.told():
            self._told(line)
            for listener in self._listeners:
                listener.post(status(StatusLevel.WARNING, line))

    async def _left(self) -> None:
        """Answer what the robot had sent, for those who still listen, and be ready for the next."""
        try:
            with suppress(RefseqError):
                await self._localise(self._session.end)
        finally:
            self._told(f"the robot is gone after {self._session.views} views")
            self._session = RobotSession(self._map, self._options)
            self._robot = None
