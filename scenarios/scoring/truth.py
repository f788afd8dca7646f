"""Truth that drives can be scored by: whether both of a comparison have true poses, and where these are from."""

from collections.abc import Sequence

from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison

SOURCE = "truth"
"""Key of a drive's metadata that names the file which its true poses were taken from, where they are not the log's."""


def has_truth(views: Sequence[View]) -> bool:
    """Tell whether at least one view has a true pose."""
    return any(view.truth is not None for view in views)


def missing_truth(comparison: Comparison) -> str:
    """Name, in a clause, what has no true pose, so that answers cannot be scored; empty where they can."""
    reference, query = has_truth(comparison.reference_views), has_truth(comparison.query_views)
    if reference and query:
        return ""
    if query:
        return "what was learnt has no true poses"
    return "the query drive has no true poses" if reference else "neither what was learnt nor the query has true poses"


def first_with_truth(comparisons: Sequence[Comparison]) -> int:
    """The number of the first of some comparisons that has true poses, which is drawn for all; 0 where none has."""
    return next((number for number, one in enumerate(comparisons) if not missing_truth(one)), 0)


def unscored_reason(comparisons: Sequence[Comparison]) -> str:
    """Say why none of some comparisons can be scored; empty where one can."""
    missing = [missing_truth(one) for one in comparisons]
    return missing[0] if missing and all(missing) else ""


def truth_estimates(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Files that true poses of some drives were taken from, each once: an estimate, as the log itself knows none."""
    drives = (metadata for one in comparisons for metadata in (one.reference_metadata, one.query_metadata))
    return tuple(dict.fromkeys(str(metadata[SOURCE]) for metadata in drives if SOURCE in metadata))
