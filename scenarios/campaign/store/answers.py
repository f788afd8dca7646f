"""Answers as the store keeps them: beliefs by method, what they cost, and how references were merged."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from refseq.belief import Belief
from refseq.logs import Recording
from refseq.logs.beliefs import read_beliefs, write_beliefs
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.merging import Merging


@dataclass(frozen=True)
class KeptAnswers:
    """``beliefs`` by method, one a view; ``mergings`` by method, of those only that have an atlas."""

    beliefs: Mapping[str, Sequence[Belief]]
    cost: Cost
    mergings: Mapping[str, Merging]


def write_answers(path: Path, query: Recording, kept: KeptAnswers) -> None:
    """Write the answers to the views of a query. Raises ``OSError``."""
    merged = {method: merging.to_dict() for method, merging in kept.mergings.items()}
    metadata = {**query.metadata, "cost": json.dumps(asdict(kept.cost)), "merged": json.dumps(merged)}
    write_beliefs(path, query.views, kept.beliefs, metadata)


def read_answers(path: Path) -> KeptAnswers:
    """The inverse. Raises ``LogError``, ``OSError``, ``ValueError``, ``KeyError``, ``TypeError`` or Arrow's errors."""
    metadata = json.loads(pq.read_schema(path).metadata[b"refseq"])
    merged = json.loads(metadata["merged"])
    mergings = {method: Merging.from_dict(content) for method, content in merged.items()}
    return KeptAnswers(read_beliefs(path), Cost(**json.loads(metadata["cost"])), mergings)


def beliefs_digest(beliefs: Sequence[Belief]) -> str:
    """Digest of some beliefs, bit for bit, but for the time that they took."""
    found = hashlib.sha256()
    for belief in beliefs:
        found.update(np.asarray(belief.places, np.float64).tobytes())
        found.update(np.array([belief.lost, belief.entropy, belief.odometer_scale], np.float64).tobytes())
        found.update(np.array([belief.best, *belief.path], np.int64).tobytes())
        found.update(repr(belief.faults).encode())
        if belief.lost_after is not None:
            found.update(np.asarray(belief.lost_after, np.float64).tobytes())
        if belief.pose is not None:
            found.update(np.array([*belief.pose.motion, *belief.pose.covariance.ravel()]).tobytes())
    return found.hexdigest()[:24]
