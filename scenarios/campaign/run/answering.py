"""Have methods learn reference drives and answer where a query drive was."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from refseq.features.memory import clock, described_once
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.campaign.run.learning import LEARNING
from refseq_bench.scenarios.campaign.store.answers import KeptAnswers
from refseq_bench.scenarios.campaign.store.descriptions import KeptDescriptions
from refseq_bench.scenarios.methods.by_name import Learnt
from refseq_bench.scenarios.methods.plugins import PluginLocaliser
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.cost import Cost, bytes_kept, forget_peak, peak_bytes
from refseq_bench.scenarios.scoring.merging import Merging

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
    ours = learnt.ours.values()
    sequences = [sequence for one in ours for sequence in one.map.sequences]
    maps, mergings = [map_ for one in ours for map_ in one.maps], [one.merging for one in ours]
    return cost_of(
        references.values(),
        (*sequences, *learnt.localisers.values()),
        learn_s=learnt_in(maps, mergings) if maps else learning,
        answer_s=answering,
        features=sum(sequence.matrix.N for sequence in sequences) or None,
        guests=learnt.guests,
    )


def cost_of(
    drives: Iterable[Reference],
    kept: Iterable[object],
    *,
    learn_s: float,
    answer_s: float,
    features: int | None,
    guests: Iterable[PluginLocaliser],
) -> Cost:
    """Cost of learning some drives and answering, for who keeps some objects; memory since ``forget_peak``.

    The worker's own memory of descriptions is none of a method's, and the processes of users' localisers are.
    """
    return Cost(
        learn_s=learn_s,
        answer_s=answer_s,
        places=sum(len(drive.views) for drive in drives),
        bytes_kept=bytes_kept(*kept),
        features=features,
        peak_bytes=peak_bytes() - MEMORY.nbytes + sum(guest.peak_bytes for guest in guests),
    )


def learnt_in(maps: Iterable[Map], mergings: Iterable[Merging | None]) -> float:
    """Time that learning some maps took [s], when they were made and not when they are read, and merging them."""
    learning = math.fsum(float(map_.metadata[LEARNING]) for map_ in maps)
    return learning + math.fsum(one.seconds for one in mergings if one is not None)
