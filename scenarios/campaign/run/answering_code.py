"""Code of answers: what a key has to follow, so that a change to one method leaves what the others answered."""

from collections.abc import Sequence
from typing import NamedTuple

from refseq.features import memory
from refseq.logs.beliefs import table
from refseq_bench.scenarios.campaign.run import answering, learning
from refseq_bench.scenarios.campaign.store import answers, cache, descriptions, recordings
from refseq_bench.scenarios.campaign.store.keys import code_digest
from refseq_bench.scenarios.methods import baselines, by_name, names, plugins, programs, reference
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.names import modules_of
from refseq_bench.scenarios.scoring import cost, merging

READER = recordings.__name__
"""Module that reads drives from the store: views change with it, though recordings, which it did not write, do not."""
SHARED = (READER, memory.__name__, table.__name__)
"""Modules that any answer comes through, with all that they import."""
ASKING = tuple(
    one.__name__
    for one in (
        answering,
        learning,
        answers,
        cache,
        descriptions,
        baselines,
        reference,
        by_name,
        names,
        plugins,
        programs,
        cost,
        merging,
    )
)
"""Modules that ask a baseline and take its answers: their own text counts for it, not our localiser behind them."""


class CodeModules(NamedTuple):
    """Modules that count with ``all`` that they import, and those that count ``alone``."""

    all: tuple[str, ...]
    alone: tuple[str, ...]


def answering_code(methods: Sequence[str], hands: Sequence[str]) -> str:
    """Digest of the code by which some methods learn and answer; ``hands`` are modules that count by their own text."""
    modules = answering_modules(methods, hands)
    return code_digest(*modules.all, alone=modules.alone)


def answering_modules(methods: Sequence[str], hands: Sequence[str]) -> CodeModules:
    """Modules that the answers of some methods follow.

    Baselines follow their own modules and what any answer comes through; our own localiser and users' follow all that
    ``answering`` can reach, which no baseline is among.
    """
    known = [BASELINES[name] for name in methods if name in BASELINES]
    modules = list(modules_of(methods))
    if any(one.mapped for one in known):
        modules.append(learning.__name__)
    if len(known) < len(methods):
        modules.append(answering.__name__)
    return CodeModules((*modules, *SHARED), (*hands, *ASKING))
