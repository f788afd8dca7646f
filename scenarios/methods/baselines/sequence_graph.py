"""Matching of image sequences as the shortest way through a graph with hidden nodes."""

import time
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST, Belief
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import answer
from refseq_bench.scenarios.methods.baselines.place_filter import neighbours
from refseq_bench.scenarios.methods.baselines.vlad import VladMap, as_vlad

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference

UNLIKE = 1e-3
"""Least cosine that a cost is made of: one at or below 0 would have none."""

TIE = 1e-6
"""Order of places whose ways cost the same, as many do behind hidden nodes: this share of a node's own cost, and
this much for each place that a step differs from one place ahead."""


@dataclass(frozen=True, slots=True)
class SequenceGraphSettings:
    """Parameters of the graph.

    From view to view the robot goes ahead or back by at most ``fan_out`` places. Looking at a place costs 1 / cosine;
    ``hidden`` is what a hidden node costs instead. When more than ``lost_share`` of the last ``window`` nodes of the
    best way are hidden, any place may follow; the share is the paper's. ``worth`` is the cost that makes a place e
    times less likely; it shapes the belief, not the answer.

    Published are fan-outs of 5 and 10, for cameras of unlike speeds, and hidden costs of 3.7 to 5 for features of a
    network. Set in the annex: ``fan_out``, ``hidden``, ``window`` and ``worth``.
    """

    fan_out: int = 2
    hidden: float = 5.0
    window: int = 5
    lost_share: float = 0.8
    worth: float = 0.5


class Node(NamedTuple):
    """A view at a place: its own cost, which a hidden node would take the place of where it is cheaper."""

    place: int
    cost: float


@dataclass(frozen=True, slots=True)
class TrellisLayer:
    """The nodes of one view, (K,) each: what the best way to them costs, their own cost, and the place before them."""

    ways: NDArray[np.float64]
    costs: NDArray[np.float64]
    before: NDArray[np.intp]


class SequenceGraph:
    """Where the cheapest way through all views up to now ends.

    O. Vysotska, C. Stachniss, "Lazy data association for image sequences matching under substantial appearance
    changes", RA-L 1(1), 2016. A node is a view taken at a place. Where a view looks so little like a place that this
    would cost more than a hidden node, the way goes through a hidden node beside it: the robot is there, but nothing
    can be matched. A way may begin at any place.

    The paper expands nodes only as far as they promise something, for maps of many thousand images. Here all are: it is
    the same cheapest way without the factor that trades its cost for speed. For the same reason any place may follow
    where the robot was lost, where the paper takes those that a hash table proposes.

    P(lost) is c / (c + ``hidden``), averaged over the last ``window`` nodes of the best way, c being what they cost: a
    node adds more than ½ where a hidden one is cheaper.
    """

    def __init__(self, places: VladMap, settings: SequenceGraphSettings | None = None) -> None:
        self._places = places
        self._settings = settings or SequenceGraphSettings()
        self._layers: deque[TrellisLayer] = deque(maxlen=self._settings.window)

    def reset(self) -> None:
        """Forget all views seen."""
        self._layers.clear()

    def update(self, view: View) -> Belief:
        """Add a view's nodes and follow the best way back."""
        likeness = self._places.compare(view)
        start = time.perf_counter()
        self._layers.append(self._next(self._costs(likeness.values)))
        last, hidden = self._layers[-1], self._settings.hidden
        order = last.ways + TIE * last.costs
        way = self._way(int(np.argmin(order)))
        lost = float(np.mean([node.cost / (node.cost + hidden) for node in way]))
        weights = np.exp((order.min() - order) / self._settings.worth)
        path = tuple(LOST if node.cost > hidden else node.place for node in way)
        return replace(answer(weights, lost, likeness, start), path=path)

    def _costs(self, cosines: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Cost of a view at each place, (K,)."""
        if cosines is None:
            return np.full(len(self._places), 1 / UNLIKE)
        return 1 / np.maximum(cosines, UNLIKE)

    def _next(self, costs: NDArray[np.float64]) -> TrellisLayer:
        """The nodes of the next view."""
        settings = self._settings
        entering = np.minimum(costs, settings.hidden)
        if not self._layers:
            return TrellisLayer(entering, costs, np.arange(len(costs)))
        last = self._layers[-1]
        if self._is_lost():
            best = int(np.argmin(last.ways + TIE * last.costs))
            return TrellisLayer(entering, costs, np.full(len(costs), best))
        ways, before = cheapest_before(last.ways, settings.fan_out)
        # Only differences count: taking off the least keeps a long drive's costs small.
        return TrellisLayer(ways - ways.min() + entering, costs, before)

    def _is_lost(self) -> bool:
        """Tell whether too many of the last nodes on the best way are hidden."""
        if len(self._layers) < self._settings.window:
            return False
        last = self._layers[-1]
        way = self._way(int(np.argmin(last.ways + TIE * last.costs)))
        hidden = sum(1 for node in way if node.cost > self._settings.hidden)
        return hidden > self._settings.lost_share * len(way)

    def _way(self, place: int) -> tuple[Node, ...]:
        """The last nodes of the best way to one of the last view, oldest first."""
        way = []
        for layer in reversed(self._layers):
            way.append(Node(place, float(layer.costs[place])))
            place = int(layer.before[place])
        return tuple(way[::-1])


def cheapest_before(ways: NDArray[np.float64], fan_out: int) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The least of ``ways`` (K,) within ``fan_out`` places of each place, and where it is, (K,) each.

    A step that goes not one place ahead costs ``TIE`` for each place of difference: of equal ways the steady one.
    """
    K = len(ways)
    sources, there = (table[:, ::-1] for table in neighbours(K, -fan_out, fan_out))  # the farthest ahead first
    steps = np.arange(-fan_out, fan_out + 1)
    costs = np.where(there, ways[sources] + TIE * np.abs(steps - 1), np.inf)
    choice = np.argmin(costs, axis=1)
    return costs[np.arange(K), choice], sources[np.arange(K), choice]


def learnt(reference: "Reference") -> SequenceGraph:
    """The method, once it has learnt a reference drive."""
    return SequenceGraph(reference.once(as_vlad))
