"""Run-out: a stretch behind each path's end, on which a robot that drives on sees what the last place sees.

In front of a camera the same door stands for many metres. A robot that has driven on past a path's end goes on seeing
what the last place saw, and a chain that does not remember how far it drove takes it for that place again and again. On
the run-out it has moved on, and the last place's likelihood, which is the run-out's too, tells nothing against that.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Observation
from refseq.inference.chain.forward import ForwardFilter, StatePosterior
from refseq.inference.chain.network import LinkedTransitions, Network
from refseq.inference.paths import usual_step

MOST = 50
"""Positions on a run-out at most, also where places lie centimetres apart: more would only cost time."""


@dataclass(frozen=True)
class LongerNetwork:
    """States of a network (K positions), and of run-outs of ``reach`` [m] behind all its paths: N positions in all.

    ``seen`` (N,) is the position of the network of which each has the likelihood: on a run-out that of its path's end.
    ``behind`` (N,) is how many steps behind an end it lies, 0 for the network's own. A robot one step behind, no
    farther than places usually lie apart, still counts as at the end.
    """

    network: Network
    longer: Network
    seen: NDArray[np.intp]
    behind: NDArray[np.intp]

    @classmethod
    def of(cls, network: Network, reach: float) -> Self:
        """The network with run-outs."""
        paths, seen, behind, first = [], [], [], 0
        for path in network.paths:
            paths.append(np.concatenate([path, run_out(path, reach)]))
            number, last = first + np.arange(len(paths[-1])), first + len(path) - 1
            seen.append(np.minimum(number, last))
            behind.append(np.maximum(number - last, 0))
            first = last + 1
        ends_seen, steps = np.concatenate(seen), np.concatenate(behind)
        places = network.places[ends_seen]
        places[steps > 0] = network.places.max() + 1 + np.arange(np.count_nonzero(steps))  # linked to nothing
        longer = replace(network, paths=tuple(paths), places=places)
        return cls(network, longer, ends_seen, steps)

    @property
    def K(self) -> int:
        """Number of positions, N; there are 2 N states."""
        return self.longer.K

    def start(self) -> NDArray[np.float64]:
        """Log-probability of each state at the first view, (2, N): none on a run-out."""
        start = np.full((2, self.K), -np.inf)
        start[:, self.behind == 0] = self.network.start()
        return start

    def transitions(self, distance: float) -> LinkedTransitions:
        """The moves over a travelled distance [m]."""
        return self.longer.transitions(distance)

    def sight(self, observation: Observation) -> Observation:
        """The observation of the network's positions, with that of the run-outs."""
        return replace(observation, places=observation.places[self.seen])

    def folded(self, posterior: StatePosterior) -> StatePosterior:
        """The posterior over the network's own states: on a run-out the robot is lost behind the path's last place."""
        at_end = self.behind <= 1
        places = np.bincount(self.seen, np.where(at_end, posterior.places, 0.0), self.network.K)
        lost = np.bincount(self.seen, posterior.lost + np.where(at_end, 0.0, posterior.places), self.network.K)
        return replace(posterior, places=np.asarray(places, np.float64), lost=np.asarray(lost, np.float64))


class RunOutFilter:
    """The forward filter over a network with run-outs: it takes and gives what that of the network itself does."""

    def __init__(self, space: LongerNetwork) -> None:
        self._space = space
        self._filter = ForwardFilter(space)

    def reset(self) -> None:
        """Forget all views seen."""
        self._filter.reset()

    def update(self, observation: Observation) -> StatePosterior:
        """Take the next view and answer from the views up to it."""
        return self._space.folded(self._filter.update(self._space.sight(observation)))


def run_out(path: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
    """Distances along a path [m], (K,), continued behind its end by its usual step, up to ``reach`` [m] farther."""
    step = max(usual_step(path), reach / MOST)
    beyond: NDArray[np.float64] = path[-1] + step * np.arange(1, max(1, round(reach / step)) + 1)
    return beyond
