"""FAB-MAP: places as bags of words, and how likely it is that a view is of none of them."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from refseq.view import View
from refseq_bench.scenarios.methods.baselines.chow_liu import ChowLiuTree
from refseq_bench.scenarios.methods.baselines.fabmap_places import Detector, PlaceModel
from refseq_bench.scenarios.methods.baselines.fabmap_words import ShownWords, WordMap
from refseq_bench.scenarios.methods.baselines.place_filter import PlaceFilter

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference


@dataclass(frozen=True, slots=True)
class FabMapSettings:
    """``new`` is the prior probability of a new place, ``smoothing`` the share σ of the likelihood that is believed.

    Both are as published. The detector, published as 0.39 and 0 for another kind of word, was chosen in the annex.
    """

    detector: Detector = field(default_factory=Detector)
    new: float = 0.9
    smoothing: float = 0.99


class FabMap(PlaceFilter[ShownWords]):
    """A Bayes filter over the places of a map and one state for all places that are not in it.

    M. Cummins, P. Newman, "FAB-MAP: probabilistic localization and mapping in the space of appearance", International
    Journal of Robotics Research 27(6), 2008.

    Before a view is looked at, the robot is at a new place with probability ``new``, else at the place where it was or
    at one of the two beside it, all three alike; had it been at a new place, anywhere. What would lie beyond the ends
    of the path is a new place. Likelihoods of all K + 1 states are made to sum to 1 and smoothed, σ P + (1 − σ) /
    (K + 1): words are not independent, and their product is far too sure of itself. Cameras are independent, with a
    vocabulary and a tree each. P(new place) is the belief's ``lost``. A view without words is an observation like any
    other (``PlaceModel``); one without a camera tells nothing.

    Vocabulary, word frequencies and tree are learnt from the reference drive, the only one that all our methods are
    given; the authors have a drive through other streets for that. It costs new places: words of other places are not
    in the vocabulary, and most pairs of words are seen together once or never, too few for a tree. Not counting a
    word's first sighting (``Bags.recognised``) helps both. New places are told by the mean-field approximation, for the
    authors' other way, an average over places of the training drive, here gives the average over the map: with all
    places alike before, P(new place) would stay at its prior whatever the view shows.
    """

    def __init__(self, words: WordMap, *, tree: bool = True, settings: FabMapSettings | None = None) -> None:
        super().__init__()
        self._words = words
        self._settings = settings or FabMapSettings()
        learn = ChowLiuTree.learn if tree else ChowLiuTree.independent
        self._models = {
            camera: PlaceModel(bags, learn(bags.recognised), self._settings.detector)
            for camera, bags in words.bags.items()
        }

    def _observe(self, view: View) -> ShownWords:
        return self._words.observe(view)

    def _predict(self, belief: NDArray[np.float64] | None, view: View) -> NDArray[np.float64]:
        """P(L) before the view, (K + 1,), the new place last: the robot has moved on by a place at most."""
        K, new = len(self._words), self._settings.new
        places = np.full(K, 1 / K) if belief is None else _moved(belief)
        return np.append((1 - new) * places, new + (1 - new) * max(1 - places.sum(), 0.0))

    def _likelihood(self, seen: ShownWords) -> NDArray[np.float64]:
        """P(Z | L) of what the view's cameras show, smoothed, (K + 1,), sum 1."""
        logs = np.zeros(len(self._words) + 1)
        for camera, shown in seen.shown.items():
            logs += self._models[camera].log_likelihood(shown)
        s = self._settings.smoothing
        return np.asarray(s * softmax(logs) + (1 - s) / len(logs))


def _moved(belief: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where a robot at one of the places (K,), and then one at a new place, is next, (K,); sum below 1 at the ends."""
    thirds = belief[:-1] / 3
    moved: NDArray[np.float64] = thirds + belief[-1] / len(thirds)
    moved[1:] += thirds[:-1]
    moved[:-1] += thirds[1:]
    return moved


def learnt(reference: "Reference") -> FabMap:
    """The method, once it has learnt a reference drive."""
    return FabMap(reference.once(WordMap))


def learnt_naive(reference: "Reference") -> FabMap:
    """The method without the tree: words independent of each other."""
    return FabMap(reference.once(WordMap), tree=False)
