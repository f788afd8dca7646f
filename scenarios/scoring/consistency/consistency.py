"""Consistency of a method's answers: all figures that need no truth, of one run or of several pooled ones."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from refseq.belief import LOST_ABOVE
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.consistency.agreement import agreement
from refseq_bench.scenarios.scoring.consistency.answers import given_answers, odometric_places
from refseq_bench.scenarios.scoring.consistency.jumps import excess, jumped
from refseq_bench.scenarios.scoring.consistency.odometry_fit import OdometryFit, odometry_fit
from refseq_bench.scenarios.scoring.path_geometry import WIDE, Tolerance
from refseq_bench.scenarios.scoring.proportion import Proportion


@dataclass(frozen=True)
class Consistency:
    """Figures of one method that need no truth.

    ``lost`` are the views at which it says lost, of all. ``jumps`` are steps from one answer to the next that odometry
    does not allow, of those that can be measured; ``fit`` is the agreement with odometry. ``entropy`` is the mean of
    the beliefs' entropies [nats], nan without a view. ``agreements`` are the views at which it means the same place as
    another method does, by that one's name, of those at which both answer.
    """

    lost: Proportion
    jumps: Proportion
    fit: OdometryFit
    entropy: float
    agreements: Mapping[str, Proportion] = field(default_factory=dict)

    @property
    def agreement(self) -> Proportion:
        """Agreement with all other methods together."""
        return Proportion.pooled(self.agreements.values())


def consistency(comparison: Comparison, method: str, tolerance: Tolerance = WIDE) -> Consistency:
    """Measure one method's answers to a drive, and how far they agree with those of each other method."""
    beliefs, places = comparison.beliefs[method], odometric_places(comparison)
    answers = given_answers(comparison, method)
    steps = jumped(answers, places, tolerance)
    measured = np.isfinite(excess(answers, places))
    return Consistency(
        lost=Proportion(sum(belief.lost > LOST_ABOVE for belief in beliefs), len(beliefs)),
        jumps=Proportion(int(steps.sum()), int(measured.sum())),
        fit=odometry_fit(answers, places, steps),
        entropy=math.fsum(belief.entropy for belief in beliefs) / len(beliefs) if beliefs else math.nan,
        agreements={
            other: agreement(comparison, places, method, other, tolerance)
            for other in comparison.beliefs
            if other != method
        },
    )


def pool_consistency(found: Sequence[Consistency]) -> Consistency:
    """Several runs as one: views, steps and answers are added up, of other methods those that all runs know."""
    views = sum(one.lost.trials for one in found)
    entropies = [one.entropy * one.lost.trials for one in found if one.lost.trials]
    shared = [name for name in found[0].agreements if all(name in one.agreements for one in found)] if found else []
    return Consistency(
        lost=Proportion.pooled([one.lost for one in found]),
        jumps=Proportion.pooled([one.jumps for one in found]),
        fit=sum((one.fit for one in found), OdometryFit()),
        entropy=math.fsum(entropies) / views if views else math.nan,
        agreements={name: Proportion.pooled([one.agreements[name] for one in found]) for name in shared},
    )
