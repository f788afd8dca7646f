"""A whole drive as a map sees it: each view by itself, online and in hindsight."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, softmax

from refseq.belief import Belief, Stage
from refseq.fault import DeclaredFault
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.measurer import Measurer
from refseq.map.stage_answers import StageAnswers
from refseq.map.tracking.hindsight import Hindsight
from refseq.map.tracking.stages import log_mean
from refseq.view import LASER, View


@dataclass(frozen=True, slots=True)
class SeenView:
    """Answer of a localiser to a view: probabilities of the places, (K,), which with being lost sum to 1.

    ``alone`` are by the view alone, ``online`` by the views up to it, ``hindsight`` by all views of the drive. Where
    cameras are asked, ``alone`` is without the scan: walls that stay tell nothing of pictures that changed.
    """

    alone: NDArray[np.float64]
    online: NDArray[np.float64]
    hindsight: NDArray[np.float64]
    faults: tuple[DeclaredFault, ...]


def seen_drive(map_: Map, views: Sequence[View], seed: int = 0) -> list[SeenView]:
    """Localise a drive, each view alone, online and in hindsight; the map's matching has to be by log ratios."""
    measurer, answers, hindsight = Measurer(map_, seed=seed), StageAnswers(map_, Stage.CHAIN), Hindsight(map_)
    alone, online = [], list[Belief]()
    with_scan = map_.sensors == {LASER}
    for view in views:
        measurer.take(view)
        alone.append(_alone(measurer.after(None), map_.profile.chain.lost_at_start, with_scan))
        online.append(answers.update(measurer))
        hindsight.take(answers.measured)
    return [
        SeenView(one, _on_map(belief), _on_map(after), belief.faults)
        for one, belief, after in zip(alone, online, hindsight.beliefs(), strict=True)
    ]


def lost_in_hindsight(seen: Sequence[SeenView]) -> NDArray[np.float64]:
    """P(lost) at each view of a drive in the light of all, (V,)."""
    return np.array([1 - view.hindsight.sum() for view in seen])


def _alone(measured: Sequence[Measurement], lost_at_start: float, with_scan: bool) -> NDArray[np.float64]:
    told = [one.log_ratio - (0.0 if with_scan else one.never_blind) for one in measured if one.log_ratio is not None]
    log_ratios = np.concatenate(told)
    on_map = expit(log_mean(log_ratios) - logit(lost_at_start))
    return np.asarray(on_map * softmax(log_ratios), np.float64)


def _on_map(belief: Belief) -> NDArray[np.float64]:
    return (1 - belief.lost) * belief.places
