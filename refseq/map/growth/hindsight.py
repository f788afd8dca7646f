"""Hindsight: where each view of a whole drive was taken, in the light of all its views, on any map."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, softmax

from refseq.belief import Belief, Stage
from refseq.fault import DeclaredFault
from refseq.inference.chain.chain import Observation
from refseq.inference.chain.run_out import path_smoothed
from refseq.map.guard import SensorGuard
from refseq.map.map import Map
from refseq.map.stages import log_mean
from refseq.map.stands import Stands
from refseq.map.trackers import tracker_for
from refseq.view import View


@dataclass(frozen=True, slots=True)
class SeenView:
    """Answer of a localiser to a view: probabilities of the places, (K,), which with being lost sum to 1.

    ``alone`` are by the view alone, ``online`` by the views up to it, ``hindsight`` by all views of the drive.
    """

    alone: NDArray[np.float64]
    online: NDArray[np.float64]
    hindsight: NDArray[np.float64]
    faults: tuple[DeclaredFault, ...]


def seen_drive(map_: Map, views: Sequence[View], seed: int = 0) -> list[SeenView]:
    """Localise a drive, each view alone, online and in hindsight; the map's matching has to be by log ratios."""
    guard, tracker, network = SensorGuard(map_, seed=seed), tracker_for(Stage.CHAIN, map_), map_.network
    alone, online, observations, stands = [], [], list[Observation](), Stands()
    for view in views:
        measured = guard.match(view)
        ratios = np.concatenate([one.log_ratio for one in measured if one.log_ratio is not None])
        alone.append(_alone(ratios, map_.profile.chain.lost_at_start))
        online.append(guard.told(tracker.update(measured)))
        counted = stands.mean(measured)
        told = np.concatenate([one.log_ratio for one in counted if one.log_ratio is not None])
        observations.append(Observation(counted[0].distance, told[network.places], 0.0, counted[0].again))
    smoothed = path_smoothed(observations, network)
    hindsight = [np.bincount(network.places, posterior.places, len(map_)) for posterior in smoothed]
    return [
        SeenView(one, _on_map(belief), np.asarray(after, np.float64), belief.faults)
        for one, belief, after in zip(alone, online, hindsight, strict=True)
    ]


def _alone(log_ratios: NDArray[np.float64], lost_at_start: float) -> NDArray[np.float64]:
    on_map = expit(log_mean(log_ratios) - logit(lost_at_start))
    return np.asarray(on_map * softmax(log_ratios), np.float64)


def _on_map(belief: Belief) -> NDArray[np.float64]:
    return (1 - belief.lost) * belief.places
