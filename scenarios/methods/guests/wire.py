"""Messages between the bench and a guest: two lengths, a JSON header, then the bytes of arrays.

Lengths are of header and payload, each a little-endian uint32; the header is a compact JSON object in ASCII. A view's
payload are its images, (height, width) uint8 each, then the scan's ranges, (beams,) float32; a belief's are its places,
(K,) float32 or float64, and behind them those that it got lost behind, (K,), where it tells. All is little-endian, row
by row, without gaps. docs/localiser-protocol.md tells each message.
"""

import json
import struct
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, PoseBeside, Timings, entropy, pose_beside
from refseq.errors import RefseqError
from refseq.view import LASER, Scan, View

PROTOCOL = 1
"""Version of the protocol: another one when a guest of this one would misread it."""
LENGTHS = struct.Struct("<II")
MOST_HEADER = 1 << 20
"""Longest header that is read [bytes]: that of a belief with a path over 100 000 views fits."""
PRECISIONS = ("float32", "float64")


class Kind(StrEnum):
    """Kind of a message, by its key ``type``."""

    HELLO = "hello"
    LEARN = "learn"
    LEARNT = "learnt"
    RESET = "reset"
    LOCALISE = "localise"
    COST = "cost"
    OK = "ok"
    BELIEF = "belief"
    ERROR = "error"


class WireError(Exception):
    """Bytes are no message, or not the one that was due; the message says why."""


@dataclass(frozen=True)
class GuestMessage:
    """A message as it came: its header and the bytes behind it."""

    header: Mapping[str, Any]
    payload: bytes = b""

    @property
    def kind(self) -> str:
        """Its type, empty where it tells none."""
        return str(self.header.get("type", ""))


def packed(kind: Kind, header: Mapping[str, object], arrays: Sequence[NDArray[Any]] = ()) -> list[memoryview]:
    """The pieces of a message, to be sent one behind the other; arrays are not copied."""
    text = json.dumps({"type": kind.value, **header}, separators=(",", ":")).encode()
    payload = [array.data.cast("B") for array in arrays if array.size]
    lengths = LENGTHS.pack(len(text), sum(piece.nbytes for piece in payload))
    return [memoryview(lengths + text), *payload]


def parsed(header: bytes, payload: bytes) -> GuestMessage:
    """A message from the bytes of its parts. Raises ``WireError``."""
    try:
        found = json.loads(header)
    except (ValueError, RecursionError):
        raise WireError(f"sent {header[:40]!r} as a header; valid is a JSON object") from None
    if not isinstance(found, dict):
        raise WireError(f"sent {header[:40]!r} as a header; valid is a JSON object")
    return GuestMessage(found, payload)


def lengths_of(prefix: bytes | bytearray, most: int) -> tuple[int, int]:
    """Lengths of header and payload. Raises ``WireError`` where they are more than can be, of a payload ``most``."""
    if bytes(prefix).isascii() and bytes(prefix).decode().replace("\n", " ").isprintable():  # no length is so large
        raise WireError(
            f"wrote {bytes(prefix).decode()!r} to standard output; valid are messages only: what it says belongs to "
            "standard error"
        )
    header, payload = LENGTHS.unpack(prefix)
    if header > MOST_HEADER or payload > most:
        raise WireError(
            f"announced {header} bytes of header and {payload} of payload; valid are up to {MOST_HEADER} and {most} "
            "(words on standard output are taken for a message: they belong to standard error)"
        )
    return header, payload


class Incoming:
    """A message that comes piece by piece, with a payload of at most ``most`` bytes."""

    def __init__(self, most: int) -> None:
        self._most, self._got = most, bytearray()
        self._lengths: tuple[int, int] | None = None

    @property
    def missing(self) -> int:
        """Bytes that are to come next; 0 where it is complete."""
        return (LENGTHS.size if self._lengths is None else sum(self._lengths)) - len(self._got)

    def take(self, piece: bytes) -> None:
        """Take at most as many bytes as are missing. Raises ``WireError`` for lengths that cannot be."""
        self._got += piece
        if self._lengths is None and not self.missing:
            self._lengths = lengths_of(self._got, self._most)
            self._got.clear()

    @property
    def message(self) -> GuestMessage:
        """The whole of it. Raises ``WireError``."""
        assert self._lengths is not None
        return parsed(bytes(self._got[: self._lengths[0]]), bytes(self._got[self._lengths[0] :]))


# --- views ---


def view_message(kind: Kind, number: int, view: View, sensors: Collection[str] | None) -> list[memoryview]:
    """A view without its true pose, of ``sensors`` only; None: of all."""
    images = {name: image for name, image in view.images.items() if sensors is None or name in sensors}
    scan = view.scan if sensors is None or LASER in sensors else None
    header = {
        "view": number,
        "time": float(view.time),
        "distance": float(view.distance),
        "turn": float(view.turn),
        "has_odometry": bool(view.has_odometry),
        "behaviour": view.behaviour,
        "images": [{"name": name, "height": len(image), "width": image.shape[1]} for name, image in images.items()],
        "scan": None if scan is None else _scan_header(scan),
    }
    arrays: list[NDArray[Any]] = [np.ascontiguousarray(image, np.uint8) for image in images.values()]
    if scan is not None:
        arrays.append(np.ascontiguousarray(scan.ranges, "<f4"))
    return packed(kind, header, arrays)


def _scan_header(scan: Scan) -> dict[str, float]:
    return {"beams": len(scan.ranges), "start": scan.start, "step": scan.step, "max_range": scan.max_range}


def view_of(message: GuestMessage) -> View:
    """The inverse; arrays cannot be written to."""
    header, images, at = message.header, {}, 0
    for one in header["images"]:
        shape = (one["height"], one["width"])
        images[one["name"]] = np.frombuffer(message.payload, np.uint8, shape[0] * shape[1], at).reshape(shape)
        at += shape[0] * shape[1]
    scan = None
    if (told := header["scan"]) is not None:
        ranges = np.frombuffer(message.payload, "<f4", told["beams"], at).astype(np.float32)  # aligned
        ranges.setflags(write=False)
        scan = Scan(ranges, told["start"], told["step"], told["max_range"])
    odometry = {name: header[name] for name in ("distance", "turn", "behaviour", "has_odometry")}
    return View(header["time"], MappingProxyType(images), scan, **odometry)


# --- beliefs ---


def belief_message(belief: Belief) -> list[memoryview]:
    """A belief, bit for bit."""
    timings, after = belief.timings, belief.lost_after
    header = {
        "places": "float64",
        "lost_after": after is not None,
        "lost": belief.lost,
        "best": belief.best,
        "path": list(belief.path),
        "entropy": belief.entropy,
        "odometer_scale": belief.odometer_scale,
        "timings": [timings.features, timings.matching, timings.mixture, timings.chain],
    }
    if (pose := belief.pose) is not None:
        header |= {"pose": list(pose.motion), "covariance": pose.covariance.ravel().tolist()}
    told = [belief.places] if after is None else [belief.places, after]
    return packed(Kind.BELIEF, header, [np.ascontiguousarray(one, "<f8") for one in told])


BELIEF_KEYS = frozenset(
    ("type", "places", "lost", "lost_after", "best", "path", "entropy", "odometer_scale", "timings")
) | {"pose", "covariance"}
"""All that the header of a belief may hold."""
STEPS = tuple(step.name for step in fields(Timings))
"""Steps that are timed, in the order of ``timings``."""


def belief_of(message: GuestMessage, places: int) -> Belief:
    """The belief of so many ``places`` in a message, its numbers unchecked; what it leaves out follows from its places.

    Raises ``WireError`` where the payload is not so long as it should be, and for keys of another type than theirs.
    """
    header = message.header
    if unknown := sorted(header.keys() - BELIEF_KEYS):
        raise WireError(f"answered a belief with {unknown[0]!r:.40}; valid are {', '.join(sorted(BELIEF_KEYS))}")
    if (precision := header.get("places")) not in PRECISIONS:
        raise WireError(f"places are {precision!r:.40}; valid are {' and '.join(PRECISIONS)}")
    dtype = np.dtype(precision).newbyteorder("<")
    if not isinstance(after := header.get("lost_after", False), bool):
        raise WireError(f"lost_after is {after!r:.40}; valid are true and false")
    arrays = 2 if after else 1
    if len(message.payload) != (due := arrays * places * dtype.itemsize):
        number = "one number" if arrays == 1 else "two numbers, of places and lost_after,"
        raise WireError(
            f"answered {len(message.payload)} bytes of {precision}; valid is {due}, {number} for each of {places} "
            "reference views"
        )
    with np.errstate(all="ignore"):  # whoever checks it says what is no probability
        found, *more = np.split(np.frombuffer(message.payload, dtype).astype(np.float64), arrays)
        best = header.get("best", int(np.argmax(found)))
        spread = header["entropy"] if "entropy" in header else max(0.0, entropy(found))
    told = _timings_of(header)
    lost_after = more[0] if more else None
    lost, path = header.get("lost", 0.0), header.get("path", (best,))
    scale = header.get("odometer_scale", 1.0)
    return Belief(
        found, lost, best, path, spread, told, lost_after=lost_after, pose=_pose_of(header), odometer_scale=scale
    )


def _timings_of(header: Mapping[str, Any]) -> Timings:
    """The times that are told, none of which is checked. Raises ``WireError`` for what is no list of all four."""
    given = header.get("timings", [0.0] * len(STEPS))
    if not isinstance(given, list) or len(given) != len(STEPS):
        raise WireError(
            f"timings are {given!r:.40}; valid is a list of {len(STEPS)} [s], for {', '.join(STEPS[:-1])} and "
            f"{STEPS[-1]}"
        )
    return Timings(*given)


def _pose_of(header: Mapping[str, Any]) -> PoseBeside | None:
    """The pose beside the best place, if it is told. Raises ``WireError`` for what is none."""
    if header.get("pose") is None:
        if header.get("covariance") is not None:
            raise WireError("told a covariance without a pose; valid are both, or neither")
        return None
    try:
        return pose_beside(header["pose"], header.get("covariance", ()))
    except RefseqError as error:
        raise WireError(str(error)) from None
