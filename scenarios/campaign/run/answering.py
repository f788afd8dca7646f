"""Have methods learn reference drives and answer where a query drive was."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from refseq.features.memory import clock, described_once
from refseq.view import View
from refseq_bench.scenarios.campaign.run.learning import LEARNING
from refseq_bench.scenarios.campaign.store.answers import KeptAnswers
from refseq_bench.scenarios.campaign.store.descriptions import KeptDescriptions
from refseq_bench.scenarios.methods.by_name import Learnt
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.cost import Cost, bytes_kept, forget_peak, peak_bytes

MEMORY = KeptDescriptions()
"""A worker's own: the next task often asks other methods about the same views."""


@dataclass(frozen=True)
class AnswerRequest:
    """``methods`` that share what is dear; ``seed`` is that of their own draws, ``merge`` as in ``Learnt``."""

    methods: tuple[str, ...]
    seed: int
    merge: bool


def answered(asked: AnswerRequest, references: Mapping[str, Reference], query: Sequence[View]) -> KeptAnswers:
    """Have the methods learn the references and answer to the query's views, without their true poses."""
    forget_peak()
    with described_once(MEMORY):
        begin = clock()
        with Learnt(asked.methods, references, seed=asked.seed, merging=asked.merge) as learnt:
            middle = clock()
            beliefs = learnt.answers([replace(view, truth=None) for view in query])
            end = clock()
            return KeptAnswers(beliefs, _cost(learnt, references, middle - begin, end - middle), learnt.mergings)


def _cost(learnt: Learnt, references: Mapping[str, Reference], learning: float, answering: float) -> Cost:
    sequences = [sequence for one in learnt.ours.values() for sequence in one.map.sequences]
    return Cost(
        learn_s=_learning(learnt, learning),
        answer_s=answering,
        places=sum(len(drive.views) for drive in references.values()),
        bytes_kept=bytes_kept(*sequences, *learnt.localisers.values()),
        features=sum(sequence.matrix.N for sequence in sequences) or None,
        peak_bytes=peak_bytes() - MEMORY.nbytes + sum(guest.peak_bytes for guest in learnt.guests),
    )


def _learning(learnt: Learnt, took: float) -> float:
    """Time that learning took [s]: now, or when the maps at hand were made."""
    if not learnt.ours:
        return took
    maps = [float(map_.metadata[LEARNING]) for one in learnt.ours.values() for map_ in one.maps]
    return math.fsum(maps) + math.fsum(one.merging.seconds for one in learnt.ours.values() if one.merging)
