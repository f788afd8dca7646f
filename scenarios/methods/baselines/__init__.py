"""Other people's methods, made small, as yardsticks on the very same views.

Each fits ``refseq.belief.LocaliserProtocol`` and is learnt from the views of a reference drive. Their parameters were
chosen in the world ``annex``, which is not scored, and stay as they are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from refseq.belief import LocaliserProtocol

if TYPE_CHECKING:  # the parts of this package shall not follow our own localiser
    from refseq_bench.scenarios.methods.reference import Reference


@dataclass(frozen=True)
class Baseline:
    """A baseline by the ``file`` of this package that holds it and the function there that learns a reference drive.

    It is imported when it is asked for, by a name that no walk along imports follows: so it has no part in the keys of
    what other methods answer, and ``module`` is what its own follow. ``mapped`` ones ask for our own localiser's map.
    """

    file: str
    function: str = "learnt"
    mapped: bool = False

    @property
    def module(self) -> str:
        """Full name of its module."""
        return f"{__name__}.{self.file}"

    def __call__(self, reference: "Reference") -> LocaliserProtocol:
        """Learn a reference drive."""
        localiser: LocaliserProtocol = getattr(import_module(self.module), self.function)(reference)
        return localiser


BASELINES: Mapping[str, Baseline] = {
    "hamming": Baseline("hamming", mapped=True),
    "vlad": Baseline("single"),
    "ransac": Baseline("ransac"),
    "fabmap-naive": Baseline("fabmap", "learnt_naive"),
    "fabmap": Baseline("fabmap"),
    "seqslam": Baseline("seqslam"),
    "sequence-graph": Baseline("sequence_graph"),
    "topological": Baseline("topological"),
    "topometric": Baseline("topometric"),
}
"""Baselines by name: each learns a reference drive and gives a localiser for others."""
