"""The filter that a chain's settings ask for, on the way and in hindsight: with run-outs and vague views or without."""

from collections.abc import Sequence

import numpy as np

from refseq.inference.chain.chain import Chain, Observation, standing_once
from refseq.inference.chain.forward import ForwardFilter, StatePosterior, smooth
from refseq.inference.chain.network import Network
from refseq.inference.chain.run_out import LongerNetwork, RunOutFilter
from refseq.inference.chain.vague import StateFilter, VagueFilter, smoothed_either_way, vaguely


def path_filter(space: Chain | Network) -> StateFilter:
    """The forward filter over one path or a network of them, with the run-outs and vague views its settings ask for."""
    longer, vague = _with_run_outs(space), space.settings.vague

    def one() -> StateFilter:
        return ForwardFilter(space) if longer is None else RunOutFilter(longer)

    return VagueFilter(one(), one(), vague) if vague > 0 else one()


def path_smoothed(observations: Sequence[Observation], space: Chain | Network) -> list[StatePosterior]:
    """The posterior at each view in the light of all, over one path or a network, with what its settings ask for.

    Of views of a robot that stands (``Observation.again``) the last one counts, and all have its posterior.
    """
    counted, number = standing_once(observations)
    smoothed, chance = _smoothed(counted, space), space.settings.vague
    if chance > 0:
        smoothed = smoothed_either_way(smoothed, _smoothed([vaguely(one) for one in counted], space), chance)
    return [smoothed[k] for k in number]


def _smoothed(observations: Sequence[Observation], space: Chain | Network) -> list[StatePosterior]:
    longer = _with_run_outs(space)
    if longer is None:
        return smooth(observations, space)
    return [longer.folded(posterior) for posterior in smooth([longer.sight(one) for one in observations], longer)]


def _with_run_outs(space: Chain | Network) -> LongerNetwork | None:
    """The network with the run-outs that its settings ask for; None where they ask for none."""
    reach = space.settings.run_out
    if reach <= 0:
        return None
    return LongerNetwork.of(space if isinstance(space, Network) else one_path(space), reach)


def one_path(chain: Chain) -> Network:
    """The network of a chain of one path."""
    return Network((chain.along,), np.arange(chain.K), chain.motion, chain.settings)
