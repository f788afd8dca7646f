"""Tasks of a robot at a place of its mission, done while it stands there."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Wait:
    """Stand for so many ``seconds``."""

    seconds: float

    def __str__(self) -> str:
        return f"wait {self.seconds:g} s"


@dataclass(frozen=True, slots=True)
class Photograph:
    """Take an image with each camera; ``name`` is what they are called."""

    name: str

    def __str__(self) -> str:
        return f"photograph {self.name!r}"


@dataclass(frozen=True, slots=True)
class Call:
    """Call the function that whoever runs the mission has given this ``name``."""

    name: str

    def __str__(self) -> str:
        return f"call {self.name!r}"


Task = Wait | Photograph | Call
