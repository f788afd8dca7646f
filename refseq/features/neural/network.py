"""A network that finds keys in pictures: an ONNX file of the user's, which OpenCV runs."""

import hashlib
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.files import open_input
from refseq.limits import NETWORK_BYTES

FILE = "REFSEQ_KEYPOINTS"
"""Variable of the environment that names the file."""
INPUT = "image"
OUTPUTS = ("score", "descriptors")


class KeyMaps(NamedTuple):
    """Answer of a network to a picture: ``score`` (height, width), and ``descriptors`` (D, rows, columns).

    The score tells how good a key each pixel is; a cell of the descriptors stands for a square of pixels.
    """

    score: NDArray[np.float32]
    descriptors: NDArray[np.float32]


class KeyNetwork:
    """A network for pictures of ``size``, width and height [pixels]; ``digest`` is the SHA-256 of its file.

    ``depth`` is D, the number of values of a descriptor. Its input, ``image``, is (1, 1, height, width) float32 from 0
    to 1; its outputs are ``score`` (1, 1, height, width) and ``descriptors`` (1, D, rows, columns). Threads may share
    one. Raises ``ValueError`` for content that is no such network.
    """

    def __init__(self, content: bytes, size: tuple[int, int]) -> None:
        self.size = size
        self.digest = hashlib.sha256(content).hexdigest()
        self._lock = Lock()
        with _quiet():
            try:
                self._net = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
            except cv2.error as error:
                raise ValueError(f"is no ONNX network that OpenCV reads: {_said(error)}") from None
            try:
                self.depth = len(self.maps(np.full(size[::-1], 128, np.uint8)).descriptors)
            except cv2.error as error:
                raise ValueError(
                    f"does not answer to {size[0]} × {size[1]} pixels with {' and '.join(OUTPUTS)}: {_said(error)}"
                ) from None

    def maps(self, image: NDArray[np.uint8]) -> KeyMaps:
        """Ask about a grey picture of its size, (height, width). Raises ``ValueError`` for outputs of other shapes."""
        with self._lock:
            self._net.setInput((image.astype(np.float32) / 255)[None, None], INPUT)
            score, descriptors = (np.asarray(output, np.float32) for output in self._net.forward(OUTPUTS))
        width, height = self.size
        if score.shape != (1, 1, height, width) or descriptors.ndim != 4 or 0 in descriptors.shape[1:]:
            raise ValueError(
                f"answers with score {score.shape} and descriptors {descriptors.shape}; valid are "
                f"(1, 1, {height}, {width}) and (1, D, rows, columns)"
            )
        if not (np.isfinite(score).all() and np.isfinite(descriptors).all()):
            raise ValueError("answers with numbers that are not finite")
        return KeyMaps(score[0, 0], descriptors[0])


def key_network(size: tuple[int, int], digest: str = "") -> KeyNetwork:
    """The user's network. Raises ``MapError`` where none is named, and for one of another ``digest``, if that is given.

    It is opened once a process, and again when its file has changed.
    """
    named = os.environ.get(FILE, "").strip()
    wanted = f"an ONNX file of sha256 {digest[:12]}…" if digest else "the path of an ONNX file"
    if not named:
        raise MapError(f"{FILE} names no neural network to find keys by; valid is {wanted}")
    path = Path(named)
    try:
        stamp = path.stat()
        found = _opened(path, size, (stamp.st_mtime_ns, stamp.st_size))
    except OSError as error:
        cause = str(error.strerror or error).partition(";")[0]
        raise MapError(f"{FILE}: {path}: cannot be read: {cause}; valid is {wanted}") from None
    except ValueError as error:
        raise MapError(f"{FILE}: {path}: {error}") from None
    if digest and found.digest != digest:
        raise MapError(f"{FILE}: {path}: is sha256 {found.digest[:12]}…; valid is {wanted}")
    return found


@lru_cache(maxsize=4)
def _opened(path: Path, size: tuple[int, int], _stamp: Sequence[int]) -> KeyNetwork:
    with open_input(path) as file:
        content = file.read(NETWORK_BYTES + 1)
    NETWORK_BYTES.check(len(content), "has", ValueError)
    return KeyNetwork(content, size)


def _said(error: cv2.error) -> str:
    """Words of an error of OpenCV's, without the place in its code."""
    return " ".join((error.err or str(error)).split())[:120]


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OpenCV from writing about a network on the terminal, which an error tells in one line."""
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)
