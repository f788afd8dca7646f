"""First touches of what a robot meets on a mission."""

from collections.abc import Sequence

from refseq.missions.log import Touch
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.contacts import ContactLog


class TouchLog:
    """Watches a robot for the things that it touches, each once; times [s] count from when it is first watched."""

    def __init__(self, bench: Bench) -> None:
        self._bench, self._contacts, self._began = bench, ContactLog(bench), bench.time
        self._touches: list[Touch] = []

    @property
    def touches(self) -> tuple[Touch, ...]:
        """All of them so far, in their order."""
        return tuple(self._touches)

    def look(self) -> Sequence[Touch]:
        """Look at this moment, and return the touches of what was not touched before."""
        self._contacts.look()
        time = self._bench.time - self._began
        new = [Touch(time, name) for name in self._contacts.found[len(self._touches) :]]
        self._touches += new
        return new
