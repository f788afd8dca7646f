"""The drive that methods learn from, with what several of them build on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.methods.shelf import WHOLE, Shelf

Made = TypeVar("Made")


@dataclass(frozen=True)
class Reference:
    """The drive to learn from."""

    views: Sequence[View]
    shelf: Shelf = WHOLE.learnt
    _made: dict[Callable[..., Any], Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, make: Callable[[Sequence[View]], Made]) -> Made:
        """Something that several baselines build on: made of the views when it is first asked for."""
        if make not in self._made:
            self._made[make] = make(self.views)
        made: Made = self._made[make]
        return made

    def map(self, profile: str) -> Map:
        """The views as our own localiser's map with a profile."""
        return self.shelf(profile, self.views)
