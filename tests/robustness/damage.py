"""Damage to bytes, to text and to tables of values, drawn from a seed."""

import random
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

Path = tuple[Any, ...]

ODD_NUMBERS = (0, -1, 1, 2, 3, 255, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, -(2**63), 10**10, 10**12)
ODD_FLOATS = (0.0, -0.0, 0.5, 1e-300, 1e300, -1e300, 1e18, 1e9, -1.0, float("inf"), float("-inf"), float("nan"))
ODD_TEXTS = (
    "", " ", ".", "..", "/", "\\", "a" * 10_000, "\n", "a\nb", "\0", "\x1b[2J", "\u202e", "é", "\U0001f916", "%s", "{}",
    "[bold]", "../../etc/passwd", "/dev/zero", "-", "--help", "1e400", "nan", "0x10", "1" * 5000, "None", "true",
)  # fmt: skip


def odd_value(rng: random.Random) -> Any:
    """A value that nobody expects."""
    kind = rng.randrange(8)
    if kind == 0:
        return rng.choice((True, False))
    if kind in (1, 2):
        return rng.choice(ODD_NUMBERS)
    if kind in (3, 4):
        return rng.choice(ODD_FLOATS)
    if kind == 5:
        return rng.choice(ODD_TEXTS)
    if kind == 6:
        return [odd_value(rng) for _ in range(rng.randrange(4))]
    return {rng.choice(ODD_TEXTS)[:40] or "a": odd_value(rng) for _ in range(rng.randrange(3))}


def near_value(rng: random.Random, value: Any) -> Any:
    """A value of the same kind as another, but not it."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return rng.choice((value + 1, value - 1, -value, 2 * value, value * 1000, *ODD_NUMBERS))
    if isinstance(value, float):
        return rng.choice((value * 1.5, -value, value * 1e6, value / 1e6, rng.uniform(-10, 10), *ODD_FLOATS))
    if isinstance(value, str):
        return rng.choice((damaged_text(rng, value), rng.choice(ODD_TEXTS), value * 2, value[: len(value) // 2]))
    return odd_value(rng)


def paths_of(tree: Any, path: Path = ()) -> Iterator[Path]:
    """Paths to all values in a table, tables and lists among them, but for the whole."""
    if path:
        yield path
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in entries:
        yield from paths_of(value, (*path, key))


def damaged_tree(rng: random.Random, tree: Any) -> Any:
    """A table with one to three things in it changed, dropped, repeated, exchanged or put in."""
    made = deepcopy(tree)
    for _ in range(rng.randrange(1, 4)):
        if paths := list(paths_of(made)):
            _damage_at(rng, made, rng.choice(paths), rng.choice(paths))
    return made


def _damage_at(rng: random.Random, tree: Any, path: Path, other: Path) -> None:
    *way, last = path
    inner = value_at(tree, tuple(way))
    match rng.randrange(8):
        case 0 | 1:
            inner[last] = odd_value(rng)
        case 2 | 3:
            inner[last] = near_value(rng, inner[last])
        case 4:
            del inner[last]
        case 5:
            inner[last] = deepcopy(value_at(tree, other))
        case 6 if isinstance(inner, dict):
            inner[rng.choice((*ODD_TEXTS, str(other[-1])))] = inner.pop(last)
        case 6:
            inner.extend(deepcopy(inner[last]) for _ in range(rng.choice((1, 2, 50))))
        case 7:
            for _ in range(rng.choice((1, 10, 40))):
                inner[last] = [inner[last]] if rng.random() < 0.5 else {"a": inner[last]}


def value_at(tree: Any, path: Path) -> Any:
    """The value under a path."""
    for key in path:
        tree = tree[key]
    return tree


def damaged_bytes(rng: random.Random, content: bytes) -> bytes:
    """Bytes of which some are flipped, cut off, cut out, repeated, exchanged, or overwritten by extremes."""
    made = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(made)) if made else 0
        length = min(rng.choice((1, 2, 4, 8, 64, 1000)), len(made) - at)
        match rng.randrange(7):
            case 0 | 1 if made:
                made[at] ^= 1 << rng.randrange(8)
            case 2:
                del made[at:]
            case 3:
                del made[at : at + length]
            case 4:
                made[at:at] = made[at : at + length] * rng.choice((1, 2, 100))
            case 5:
                made[at : at + length] = bytes([rng.choice((0, 255, 127, 128))]) * length
            case 6:
                made[at : at + length] = rng.randbytes(length)
    return bytes(made)


def damaged_text(rng: random.Random, text: str, words: tuple[str, ...] = ()) -> str:
    """A text of which some characters or words are dropped, repeated, exchanged or put in."""
    made = text
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(made) + 1)
        to = min(len(made), at + rng.choice((1, 2, 5, 20)))
        put = rng.choice((*ODD_TEXTS, *words, *words, "_", "[", "]", "0", "99999999999999999999", "-", "."))
        start, inside, rest = made[:at], made[at:to], made[to:]
        made = rng.choice(
            (
                start + rest,
                start + put + inside + rest,
                start + put + rest,
                start + inside * rng.choice((2, 10, 1000)) + rest,
                start,
            )
        )
    return made
