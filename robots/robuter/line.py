"""A serial line between the Robuter and whoever commands it, without the cable: two queues of bytes.

What is written is there at the next tick. The time that bytes need on a real line is left out (a choice): a state of
180 bytes takes 16 ms at 115 200 baud, less than one tick of the robot.
"""

from dataclasses import dataclass, field

CAPACITY = 4096
"""Bytes that wait in one direction; what comes on top is lost, as on a line without handshake."""


class Wire:
    """One direction."""

    def __init__(self) -> None:
        self._waiting = bytearray()

    def put(self, data: bytes) -> None:
        """Write; what does not fit is lost."""
        self._waiting += data[: CAPACITY - len(self._waiting)]

    def take(self, most: int = CAPACITY) -> bytes:
        """Read what waits, the oldest first, at most so many bytes."""
        if not self._waiting:
            return b""
        data = bytes(self._waiting[:most])
        del self._waiting[:most]
        return data


@dataclass(frozen=True, slots=True)
class SerialLine:
    """Both directions."""

    to_robot: Wire = field(default_factory=Wire)
    to_host: Wire = field(default_factory=Wire)
