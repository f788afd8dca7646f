"""Frames against those of the SDK's own server, and the rules of who may come in."""

import json
import struct
from typing import Any

import foxglove
import pytest
from foxglove.channels import PoseInFrameChannel
from foxglove.messages import PoseInFrame
from foxglove.websocket import Capability
from websockets.sync.client import ClientConnection, connect

from refseq.errors import RefseqError
from refseq.serve.answers import POSE
from refseq.serve.protocol import (
    SUBPROTOCOLS,
    Advertise,
    ClientChannel,
    FoxgloveProtocolError,
    Message,
    Subscribe,
    Unserved,
    Unsubscribe,
    advertise,
    message_data,
    read_frame,
    server_info,
)
from refseq.serve.session import ServeOptions


class SdkListener:
    """Hears what clients of the SDK's server publish."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, str, bytes]] = []
        self._topics: dict[int, tuple[str, str]] = {}

    def on_client_advertise(self, client: Any, channel: Any) -> None:
        self._topics[channel.id] = (channel.topic, channel.schema_name)

    def on_message_data(self, client: Any, client_channel_id: int, data: bytes) -> None:
        self.heard.append((*self._topics[client_channel_id], data))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("on_"):
            return lambda *given: None
        raise AttributeError(name)


def texts(socket: ClientConnection, count: int) -> dict[str, Any]:
    frames = [json.loads(socket.recv(10)) for _ in range(count)]
    return {frame["op"]: frame for frame in frames}


def test_frames_are_those_of_the_sdk() -> None:
    context, listener = foxglove.Context(), SdkListener()
    server = foxglove.start_server(
        port=0, context=context, capabilities=[Capability.ClientPublish], server_listener=listener,  # type: ignore[arg-type]
        supported_encodings=["protobuf", "json", "cdr"], name="refseq", session_id="s",
    )  # fmt: skip
    channel = PoseInFrameChannel("/belief_pose", context=context)
    pose = PoseInFrame(frame_id="map")
    with connect(f"ws://127.0.0.1:{server.port}", subprotocols=[SUBPROTOCOLS[0]]) as socket:  # type: ignore[list-item]
        assert socket.subprotocol == SUBPROTOCOLS[0]
        theirs = texts(socket, 2)
        told = {"id": 3, "topic": "/laser", "encoding": "json", "schemaName": "foxglove.LaserScan"}
        socket.send(json.dumps({"op": "advertise", "channels": [told]}))
        socket.send(struct.pack("<BI", 1, 3) + b"{}")
        number = theirs["advertise"]["channels"][0]["id"]
        socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": number}]}))
        data: bytes | str = ""
        while isinstance(data, str):
            channel.log(pose, log_time=1_700_000_000_000_000_123)
            try:
                data = socket.recv(0.2)
            except TimeoutError:
                continue
    server.stop()
    assert listener.heard == [("/laser", "foxglove.LaserScan", b"{}")]
    assert data == message_data(7, 1_700_000_000_000_000_123, pose.encode())
    ours = json.loads(server_info("refseq", "s"))
    their_info = theirs["serverInfo"]
    assert {key: ours[key] for key in ("op", "name", "sessionId")} == {
        key: their_info[key] for key in ("op", "name", "sessionId")
    }
    assert set(their_info["capabilities"]) == set(ours["capabilities"])
    assert sorted(their_info["supportedEncodings"]) == sorted(ours["supportedEncodings"])
    (their_channel,) = theirs["advertise"]["channels"]
    (our_channel,) = json.loads(advertise((POSE,)))["channels"]
    assert {**our_channel, "id": 0} == {**{key: their_channel[key] for key in our_channel}, "id": 0}


def test_client_frames_are_read() -> None:
    channels = [{"id": 1, "topic": "/a", "encoding": "json", "schemaName": "x", "schema": "ignored"}]
    assert read_frame(json.dumps({"op": "advertise", "channels": channels})) == Advertise(
        (ClientChannel(1, "/a", "json", "x"),)
    )
    pairs = [{"id": 1, "channelId": 2}]
    assert read_frame(json.dumps({"op": "subscribe", "subscriptions": pairs})) == Subscribe(((1, 2),))
    assert read_frame('{"op": "unsubscribe", "subscriptionIds": [1]}') == Unsubscribe((1,))
    assert read_frame(struct.pack("<BI", 1, 9) + b"data") == Message(9, b"data")
    assert read_frame('{"op": "getParameters"}') == Unserved('"getParameters"')


@pytest.mark.parametrize(
    "frame",
    [
        "", "[]", "3", '{"op": []}', '{"op": "advertise"}', '{"op": "advertise", "channels": 3}',
        '{"op": "advertise", "channels": [{"id": 1, "topic": 3, "encoding": "json", "schemaName": "x"}]}',
        json.dumps({"op": "unsubscribe", "subscriptionIds": list(range(1000))}),
        '{"op": "unsubscribe", "subscriptionIds": [true]}', b"", b"\x01abc",
    ],
)  # fmt: skip
def test_what_is_no_frame_is_one_line(frame: str | bytes) -> None:
    if frame == '{"op": []}':
        assert read_frame(frame) == Unserved("[]")
        return
    with pytest.raises(FoxgloveProtocolError) as error:
        read_frame(frame)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        ("[1]", "the frame is [1]; valid is an object"),
        ('{"op": "advertise", "channels": 5}', "channels is 5; valid is a list"),
        ('{"op": "subscribe", "subscriptions": [3]}', "subscriptions[0] is 3; valid is an object"),
        ('{"op": "unadvertise", "channelIds": [1, "a"]}', 'channelIds[1] is "a"; valid is a whole number from 0 to '),
        ('{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}', "id is -1; valid is a whole number"),
        (
            '{"op": "advertise", "channels": [{"id": 1, "topic": null, "encoding": "json", "schemaName": "x"}]}',
            "topic is null; valid is a text of at most 256 letters",
        ),
    ],
)
def test_a_frame_s_wrong_value_is_told_with_its_key_and_what_is_valid(frame: str, reason: str) -> None:
    with pytest.raises(FoxgloveProtocolError) as error:
        read_frame(frame)
    assert str(error.value).startswith(f"a frame is no control frame of the protocol: {reason}")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0])
def test_lengths_and_times_are_numbers(value: float) -> None:
    with pytest.raises(RefseqError, match=r"distance .* is not valid; valid is a number of 0 or more"):
        ServeOptions(distance=value)
    with pytest.raises(RefseqError, match=r"tolerance .* is not valid; valid is a number of 0 or more"):
        ServeOptions(tolerance=value)
