"""Frames of the Foxglove WebSocket protocol, as a server reads and writes them.

Control frames are JSON texts with an ``op``; message data are binary: an opcode, a little-endian number, the message.
The protocol is that of https://github.com/foxglove/ws-protocol; what the server needs of it fits on a page.
"""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from refseq.errors import RefseqError

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol, the newer first; both have the frames that are used here."""

OPS = ("advertise", "unadvertise", "subscribe", "unsubscribe")
"""Kinds of a client's control frames that are served."""
MESSAGE = 1
"""Opcode of message data, in either direction."""
CLIENT_MESSAGE = struct.Struct("<BI")
SERVER_MESSAGE = struct.Struct("<BIQ")
MOST_CHANNELS = 256
"""The most channels that a client may tell of."""
MOST_LETTERS = 256
"""The most letters of a topic, an encoding or a schema's name."""


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


@dataclass(frozen=True, slots=True)
class Unserved:
    """A request of a kind that is not served; ``op`` is its kind in JSON."""

    op: str


Frame = Advertise | Unadvertise | Subscribe | Unsubscribe | Message | Unserved


def read_frame(frame: str | bytes) -> Frame:
    """Read a client's frame.

    Raises ``FoxgloveProtocolError`` for bytes that are none.
    """
    if isinstance(frame, bytes):
        return _message(frame)
    try:
        return _control(_object(json.loads(frame), "the frame"))
    except (ValueError, KeyError, RecursionError) as error:
        raise FoxgloveProtocolError(f"a frame is no control frame of the protocol: {_reason(error)}") from error


def _control(told: Mapping[str, Any]) -> Frame:
    match told["op"]:
        case "advertise":
            return Advertise(tuple(_channel(one) for one in _objects(told, "channels")))
        case "unadvertise":
            return Unadvertise(_numbers(told, "channelIds"))
        case "subscribe":
            items = _objects(told, "subscriptions")
            return Subscribe(tuple((_number(one["id"], "id"), _number(one["channelId"], "channelId")) for one in items))
        case "unsubscribe":
            return Unsubscribe(_numbers(told, "subscriptionIds"))
    return Unserved(_short(told["op"]))


def _reason(error: Exception) -> str:
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)[:200].splitlines()[0]


def _message(frame: bytes) -> Message:
    if len(frame) < CLIENT_MESSAGE.size or frame[0] != MESSAGE:
        raise FoxgloveProtocolError(
            f"a binary frame of {len(frame)} bytes begins with {frame[:1].hex() or 'nothing'}; valid is 01, the "
            "channel's number in four bytes and the message"
        )
    return Message(CLIENT_MESSAGE.unpack_from(frame)[1], frame[CLIENT_MESSAGE.size :])


def _channel(told: Mapping[str, Any]) -> ClientChannel:
    number = _number(told["id"], "id")
    topic, encoding, schema = (_text(told[key], key) for key in ("topic", "encoding", "schemaName"))
    return ClientChannel(number, topic, encoding, schema)


def _number(value: object, key: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 32:
        raise ValueError(f"{key} is {_short(value)}; valid is a whole number from 0 to {(1 << 32) - 1}")
    return value


def _text(value: object, key: str) -> str:
    if not isinstance(value, str) or len(value) > MOST_LETTERS:
        raise ValueError(f"{key} is {_short(value)}; valid is a text of at most {MOST_LETTERS} letters")
    return value


def _object(value: object, place: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ValueError(f"{place} is {_short(value)}; valid is an object")
    return value


def _list(told: Mapping[str, Any], key: str) -> list[Any]:
    items = told[key]
    if not isinstance(items, list):
        raise ValueError(f"{key} is {_short(items)}; valid is a list")
    if len(items) > MOST_CHANNELS:
        raise ValueError(f"{key} lists more than {MOST_CHANNELS}; it lists {len(items)}")
    return items


def _objects(told: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    return [_object(one, f"{key}[{place}]") for place, one in enumerate(_list(told, key))]


def _numbers(told: Mapping[str, Any], key: str) -> tuple[int, ...]:
    return tuple(_number(one, f"{key}[{place}]") for place, one in enumerate(_list(told, key)))


def _short(value: object) -> str:
    """A value as JSON has it, cut to fit a line."""
    return json.dumps(value)[:60]


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
