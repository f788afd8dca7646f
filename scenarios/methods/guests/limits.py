"""Limits of a guest: time, memory, threads and files."""

import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace

from refseq_bench.scenarios.errors import ScenarioError

SETTING = "REFSEQ_LOCALISER_LIMITS"
"""Environment variable that sets limits, as ``memory=16,view=300``."""
GIB, MIB = 2**30, 2**20


@dataclass(frozen=True)
class GuestLimits:
    """Limits of one guest.

    ``start`` is the time to be ready, imports included, ``learn`` to learn all reference views, ``view`` to answer to
    one view [s, wall]. ``memory`` is what it may hold [GiB], ``threads`` how many it may have, ``scratch`` what it may
    write into its folder [GiB]. Besides these it is
    a single process, opens 128 files at a time and writes none larger than 64 MiB.
    """

    start: float = 120.0
    learn: float = 3600.0
    view: float = 60.0
    memory: float = 4.0
    threads: float = 256
    scratch: float = 1.0

    @property
    def memory_bytes(self) -> int:
        """Memory that it may hold [bytes]."""
        return int(self.memory * GIB)

    @property
    def scratch_bytes(self) -> int:
        """Bytes that it may write into its folder."""
        return int(self.scratch * GIB)

    def __str__(self) -> str:
        return ", ".join(f"{name}={value:g}" for name, value in asdict(self).items())


OPEN_FILES, FILE_BYTES = 128, 64 * MIB
NAMES = tuple(one.name for one in fields(GuestLimits))


def limits_here(environment: Mapping[str, str] | None = None) -> GuestLimits:
    """The limits that the user's environment sets. Raises ``ScenarioError`` for what it sets wrongly."""
    text = (os.environ if environment is None else environment).get(SETTING, "")
    given: dict[str, float] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        name, _, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if name not in NAMES or not 0 < number < math.inf:
            raise ScenarioError(
                f"{SETTING}: {part!r:.60} is not valid; it should be NAME=NUMBER above 0, names are {', '.join(NAMES)}"
            )
        given[name] = number
    return replace(GuestLimits(), **given)
