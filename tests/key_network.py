"""A small neural network that finds keys, written as an ONNX file: corners by a Laplacian, described by fixed filters.

The format is that of protocol buffers: a field is its number and kind, then a whole number, or a length and bytes.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DEPTH, CELL = 16, 8
FLOAT, INTS = 1, 7
"""ONNX's numbers for an array of float32, and for an attribute of whole numbers."""


def write_key_network(path: Path, width: int = 640, height: int = 480, seed: int = 1, depth: int = DEPTH) -> Path:
    """Write one for pictures of that size; another ``seed`` describes keys in another way.

    As those of others, it takes no other size: it adds a map to one of its own.
    """
    filters = np.random.default_rng(seed).normal(size=(depth, 1, CELL, CELL))
    filters -= filters.mean(axis=(1, 2, 3), keepdims=True)
    laplacian = np.array([[0, 1, 0], [1, -4, 1], [0, 1, 0]], np.float32).reshape(1, 1, 3, 3)
    nodes = [
        _node("Conv", ["image", "laplacian"], "curvature", pads=[1, 1, 1, 1]),
        _node("Add", ["curvature", "nothing"], "sum"),
        _node("Abs", ["sum"], "score"),
        _node("Conv", ["image", "filters"], "descriptors", strides=[CELL, CELL]),
    ]
    graph = b"".join(
        [
            *(_bytes(1, node) for node in nodes),
            _bytes(2, b"keys"),
            _bytes(5, _array("laplacian", laplacian)),
            _bytes(5, _array("nothing", np.zeros((1, 1, height, width), np.float32))),
            _bytes(5, _array("filters", filters.astype(np.float32))),
            _bytes(11, _value("image", (1, 1, height, width))),
            _bytes(12, _value("score", (1, 1, height, width))),
            _bytes(12, _value("descriptors", (1, depth, height // CELL, width // CELL))),
        ]
    )
    path.write_bytes(_whole(1, 8) + _bytes(7, graph) + _bytes(8, _bytes(1, b"") + _whole(2, 17)))
    return path


def _node(kind: str, inputs: Sequence[str], output: str, **attributes: Sequence[int]) -> bytes:
    told = [_bytes(1, name.encode()) for name in inputs] + [_bytes(2, output.encode()), _bytes(4, kind.encode())]
    for name, numbers in attributes.items():
        whole = b"".join(_whole(8, number) for number in numbers)
        told.append(_bytes(5, _bytes(1, name.encode()) + whole + _whole(20, INTS)))
    return b"".join(told)


def _array(name: str, numbers: NDArray[np.float32]) -> bytes:
    sizes = b"".join(_whole(1, size) for size in numbers.shape)
    return sizes + _whole(2, FLOAT) + _bytes(8, name.encode()) + _bytes(9, numbers.tobytes())


def _value(name: str, shape: Iterable[int]) -> bytes:
    sizes = b"".join(_bytes(1, _whole(1, size)) for size in shape)
    return _bytes(1, name.encode()) + _bytes(2, _bytes(1, _whole(1, FLOAT) + _bytes(2, sizes)))


def _whole(field: int, number: int) -> bytes:
    return _varint(field << 3) + _varint(number)


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _varint(number: int) -> bytes:
    parts = []
    while number > 127:
        parts.append(number & 127 | 128)
        number >>= 7
    return bytes([*parts, number])
