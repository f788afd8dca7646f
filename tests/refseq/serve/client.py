"""A robot on the other side of the socket: the plain client of the page, and `websockets` below it."""

import json
import struct
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import make_reader
from websockets.sync.client import ClientConnection, connect


class Sent(NamedTuple):
    """A channel's topic, encoding and schema, and the bytes of a message."""

    topic: str
    encoding: str
    schema: str
    data: bytes


class Robot:
    """Publishes messages, told of before the first, and listens to beliefs."""

    def __init__(self, address: str, **more: Any) -> None:
        self._open = ExitStack()
        opened = connect(address, subprotocols=["foxglove.sdk.v1"], max_size=None, **more)
        self.socket: ClientConnection = self._open.enter_context(opened)
        self.info = json.loads(self.socket.recv(10))
        self.channels = json.loads(self.socket.recv(10))["channels"]
        self.notes: list[str] = []
        numbers = enumerate(self.channels)
        wanted = [{"id": number, "channelId": channel["id"]} for number, channel in numbers]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def advertise(self, channels: Iterable[tuple[str, str, str]]) -> dict[str, int]:
        """Tell of channels (topic, encoding, schema); gives their numbers."""
        told = [
            {"id": number, "topic": topic, "encoding": encoding, "schemaName": schema}
            for number, (topic, encoding, schema) in enumerate(channels)
        ]
        self.socket.send(json.dumps({"op": "advertise", "channels": told}))
        return {one["topic"]: one["id"] for one in told}  # type: ignore[misc]

    def drive(self, messages: list[Sent], quiet: float = 2.0) -> list[dict[str, Any]]:
        """Send all; gives the beliefs that come until none has come for ``quiet`` seconds."""
        numbers = self.advertise(dict.fromkeys((one.topic, one.encoding, one.schema) for one in messages))
        beliefs = []
        for one in messages:
            self.socket.send(struct.pack("<BI", 1, numbers[one.topic]) + one.data)
            beliefs += self.received(0)
        return beliefs + list(self.received(quiet))

    def received(self, quiet: float) -> Iterator[dict[str, Any]]:
        """Beliefs that are there; poses are among them as ``{"pose_message": bytes}``."""
        try:
            while True:
                frame = self.socket.recv(quiet)
                if isinstance(frame, str):
                    self.notes.append(json.loads(frame)["message"])
                    continue
                opcode, subscription, _ = struct.unpack_from("<BIQ", frame)
                assert opcode == 1
                if subscription == 0:
                    yield json.loads(frame[13:])
                else:
                    yield {"pose_message": frame[13:]}
        except TimeoutError:
            return

    def close(self) -> None:
        self._open.close()


def in_log(path: Path) -> list[Sent]:
    """The messages of an MCAP file, as they are; a robot tells no truth."""
    with path.open("rb") as file:
        return [
            Sent(channel.topic, channel.message_encoding, schema.name, message.data)
            for schema, channel, message in make_reader(file).iter_messages()
            if schema is not None and schema.name != "foxglove.PoseInFrame"
        ]
