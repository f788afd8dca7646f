"""Both robots, for tests of what they have in common."""

import pytest

ROBOTS = ("robuter", "segway_rmp")


def mostly(robot: str, argument: str = "robot") -> pytest.MarkDecorator:
    """Both robots under the name ``argument``, of which the other than ``robot`` waits for the slow run.

    Behaviours know of a robot only its shape and limits: what one does in a place tells nearly all of the other.
    """
    marks = {one: [] if one == robot else [pytest.mark.slow] for one in ROBOTS}
    return pytest.mark.parametrize(argument, [pytest.param(one, marks=marks[one]) for one in ROBOTS])
