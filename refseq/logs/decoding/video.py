"""Pictures of a compressed video, each decoded from the last key frame on, only when asked for."""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.limits import PIXELS, VIDEO_FRAMES
from refseq.logs.decoding.picture import check_size
from refseq.logs.decoding.unpacking import translating

CODECS = {"h264": "h264", "h265": "hevc"}
START_CODE = re.compile(rb"\x00\x00\x01(.)", re.DOTALL)
KEY_UNITS = frozenset({5, 7}), frozenset({16, 17, 18, 19, 20, 21, 32, 33})
"""Types of units that begin a key frame, a picture by itself or its parameters: of H.264, and of H.265."""


@dataclass(slots=True)
class _Group:
    """Packets from a key frame on, and the decoder that has got to packet ``at``."""

    format: str
    packets: list[bytes] = field(default_factory=list)
    at: int = 0
    decoder: Any = None

    def frame(self, number: int) -> NDArray[np.uint8]:
        """Grey pixels of one packet's picture; those before it are decoded on the way."""
        if self.decoder is None or self.at > number:
            self.decoder, self.at = _decoder(self.format), 0
        found: list[Any] = []
        for data in self.packets[self.at : number + 1]:
            found = _decoded(self.decoder, data)
        self.at = number + 1
        if not found:  # the decoder waits for more, and goes on only afresh once it is flushed
            found, self.decoder = _decoded(self.decoder, None), None
        if not found:
            raise LogError("a picture of the video cannot be decoded; valid is one frame a message, without B-frames")
        check_size(found[-1].width, found[-1].height)
        return np.asarray(found[-1].to_ndarray(format="gray"), np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class VideoPicture:
    """One picture of a video; it keeps the packets that it depends on."""

    encoding: str
    _group: _Group
    _number: int
    is_depth: bool = False

    def decode(self) -> NDArray[np.uint8]:
        """Grey pixels, (height, width). Raises ``LogError`` where the extra ``video`` is absent, and for damage."""
        return self._group.frame(self._number)


class VideoStream:
    """One topic's video: packets in the order of the log to pictures."""

    def __init__(self) -> None:
        self._group: _Group | None = None

    def picture(self, data: bytes, form: str) -> VideoPicture | None:
        """The picture of a packet; None before the first key frame. Raises ``LogError`` for a format not read."""
        if form not in CODECS:
            raise LogError(f"video format {form!r} is not read; valid are {' and '.join(CODECS)}")
        if any(_begins_group(unit[1][0], form) for unit in START_CODE.finditer(data)):
            self._group = _Group(form)
        if self._group is None:
            return None
        VIDEO_FRAMES.check(len(self._group.packets) + 1, "a video has")
        self._group.packets.append(data)
        return VideoPicture(form, self._group, len(self._group.packets) - 1)


def _begins_group(head: int, form: str) -> bool:
    """Tell whether a unit with this first byte begins a key frame."""
    return head & 31 in KEY_UNITS[0] if form == "h264" else head >> 1 & 63 in KEY_UNITS[1]


def _decoder(form: str) -> Any:
    try:
        import av
    except ImportError as error:
        raise LogError("CompressedVideo needs PyAV; valid is the extra: pip install '.[video]' in a clone") from error
    made = av.CodecContext.create(CODECS[form], "r")
    made.thread_count = 1  # frame threads would hold pictures back
    made.options = {"max_pixels": str(int(PIXELS)), "flags": "low_delay"}
    return made


def _decoded(decoder: Any, data: bytes | None) -> list[Any]:
    import av

    with translating(lambda why: LogError(f"a picture of the video cannot be decoded: {why}; valid are h264 and h265")):
        return list(decoder.decode(None if data is None else av.Packet(data)))
