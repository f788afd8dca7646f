"""Frames of the Foxglove WebSocket protocol, as a server reads and writes them.

Control frames are JSON texts with an ``op``; message data are binary: an opcode, a little-endian number, the message.
The protocol is that of https://github.com/foxglove/ws-protocol; what the server needs of it fits on a page.
"""

import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from refseq.errors import RefseqError

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol, the newer first; both have the frames that are used here."""

MESSAGE = 1
"""Opcode of message data, in either direction."""
CLIENT_MESSAGE = struct.Struct("<BI")
SERVER_MESSAGE = struct.Struct("<BIQ")
MOST_CHANNELS = 256
"""The most channels that a client may tell of."""


class FoxgloveProtocolError(RefseqError):
    """A frame that is none of the protocol."""


class StatusLevel(IntEnum):
    """Severity of a status."""

    INFO = 0
    WARNING = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class ServerChannel:
    """A channel on which the server publishes; ``schema`` is a JSON Schema, or Protobuf's descriptors in base64."""

    number: int
    topic: str
    encoding: str
    schema_name: str
    schema: str
    schema_encoding: str


@dataclass(frozen=True, slots=True)
class ClientChannel:
    """A channel on which a client publishes."""

    number: int
    topic: str
    encoding: str
    schema_name: str


@dataclass(frozen=True, slots=True)
class Advertise:
    """The client will publish on channels."""

    channels: tuple[ClientChannel, ...]


@dataclass(frozen=True, slots=True)
class Unadvertise:
    """The client publishes on channels no more."""

    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Subscribe:
    """The client wants what is published on channels: (its number of the subscription, channel)."""

    subscriptions: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    """The client wants some subscriptions no more."""

    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Message:
    """Bytes that the client publishes on one of its channels."""

    number: int
    data: bytes


Frame = Advertise | Unadvertise | Subscribe | Unsubscribe | Message


def read_frame(frame: str | bytes) -> Frame | None:
    """A client's frame; None for one of a kind that is not served.

    Raises ``FoxgloveProtocolError`` for bytes that are none.
    """
    if isinstance(frame, bytes):
        return _message(frame)
    try:
        told = json.loads(frame)
        match told["op"]:
            case "advertise":
                return Advertise(tuple(_bounded(_channel(one) for one in told["channels"])))
            case "unadvertise":
                return Unadvertise(tuple(_bounded(_number(one) for one in told["channelIds"])))
            case "subscribe":
                pairs = ((_number(one["id"]), _number(one["channelId"])) for one in told["subscriptions"])
                return Subscribe(tuple(_bounded(pairs)))
            case "unsubscribe":
                return Unsubscribe(tuple(_bounded(_number(one) for one in told["subscriptionIds"])))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FoxgloveProtocolError(f"a frame is no control frame of the protocol: {_reason(error)}") from error
    return None


def _reason(error: Exception) -> str:
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)[:200].splitlines()[0]


def _message(frame: bytes) -> Message | None:
    if len(frame) < CLIENT_MESSAGE.size or frame[0] != MESSAGE:
        raise FoxgloveProtocolError(
            f"a binary frame of {len(frame)} bytes begins with {frame[:1].hex() or 'nothing'}; valid is 01, the "
            "channel's number in four bytes and the message"
        )
    return Message(CLIENT_MESSAGE.unpack_from(frame)[1], frame[CLIENT_MESSAGE.size :])


def _channel(told: Mapping[str, Any]) -> ClientChannel:
    return ClientChannel(_number(told["id"]), _text(told["topic"]), _text(told["encoding"]), _text(told["schemaName"]))


def _number(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 32:
        raise ValueError(f"{value!r} is no number of a channel")
    return value


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > 256:
        raise ValueError(f"{value!r} is no name")
    return value


def _bounded(items: Iterator[Any]) -> Iterator[Any]:
    for count, item in enumerate(items):
        if count >= MOST_CHANNELS:
            raise ValueError(f"it lists more than {MOST_CHANNELS}")
        yield item


def server_info(name: str, session: str) -> str:
    """The first frame of a connection."""
    return json.dumps(
        {
            "op": "serverInfo",
            "name": name,
            "capabilities": ["clientPublish"],
            "supportedEncodings": ["protobuf", "json", "cdr"],
            "metadata": {},
            "sessionId": session,
        }
    )


def advertise(channels: tuple[ServerChannel, ...]) -> str:
    """The frame that tells of the server's channels."""
    told = [
        {
            "id": one.number,
            "topic": one.topic,
            "encoding": one.encoding,
            "schemaName": one.schema_name,
            "schema": one.schema,
            "schemaEncoding": one.schema_encoding,
        }
        for one in channels
    ]
    return json.dumps({"op": "advertise", "channels": told})


def status(level: StatusLevel, message: str) -> str:
    """A frame with a line for people."""
    return json.dumps({"op": "status", "level": int(level), "message": message})


def message_data(subscription: int, nanoseconds: int, data: bytes) -> bytes:
    """A frame with a message for a subscription, at a log time [ns]."""
    return SERVER_MESSAGE.pack(MESSAGE, subscription, max(0, nanoseconds)) + data
