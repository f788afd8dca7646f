"""Equality of what holds arrays: a dataclass' own ``==`` asks an array for one truth, and fails."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np


class SameValues:
    """Base of dataclasses with ``eq=False`` that are equal where all their compared fields are, number by number."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        """True for one of the same class whose values are the same."""
        if type(other) is not type(self):
            return NotImplemented
        names = (at.name for at in fields(self) if at.compare)  # type: ignore[arg-type]
        return all(_same(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(value, other[key]) for key, value in one.items())
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return type(one) is type(other) and np.array_equal(one, other)
    return bool(one == other)
