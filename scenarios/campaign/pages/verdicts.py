"""Verdicts of a campaign in words, a row a case, for its page, the terminal and Markdown."""

from dataclasses import dataclass

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages.decisive import undecided
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord
from refseq_bench.scenarios.report.words import duration_text
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.tables import NONE

INDEX = "index.html"
"""Name of the page that has them, in the campaign's folder."""


@dataclass(frozen=True)
class IndexRow:
    """A case in words; ``within`` and ``narrow`` are the tolerances of the successes, empty where there are none.

    ``undecided`` is why it tells nothing, or no methods apart; empty where it does.
    """

    name: str
    page: str | None
    verdict: str
    judged: str
    success: str
    within: str
    success_narrow: str
    narrow: str
    failures: str
    met: str
    reason: str
    seconds: str
    undecided: str = ""


def verdict_line(record: CampaignRecord) -> str:
    """The verdicts of the cases that decide, counted; then those that do not."""
    parts = []
    for blocking, after in ((True, ""), (False, " (not blocking)")):
        counts = [(record.count(verdict, blocking=blocking), verdict.value) for verdict in Verdict]
        left = sum(case.verdict is None and case.blocking is blocking for case in record.cases)
        words = ", ".join(f"{count} {word}" for count, word in [*counts, (left, "not judged")] if count)
        parts += [words + after] if words else []
    return "; ".join(parts) or "no case"


def index_row(case: CaseRecord) -> IndexRow:
    """A case's row in the table of verdicts."""
    judged = case.method(case.judged)
    met, expected = case.met
    reasons = case.reasons or ((f"not scored: {case.unscored}",) if case.unscored else ())
    return IndexRow(
        name=case.name,
        page=case.page,
        verdict=case.verdict_word,
        judged=method_label(case.judged),
        success=judged.success.text if judged else NONE,
        within=f"{judged.within_m:g} m" if judged else "",
        success_narrow=judged.success_narrow.text if judged else NONE,
        narrow=f"{judged.narrow_m:g} m" if judged else "",
        failures=judged.success.failed if judged else NONE,
        met=f"{met} of {expected}" if expected else NONE,
        reason=reasons[0] + (f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else "") if reasons else "",
        seconds=duration_text(case.seconds),
        undecided=undecided(case),
    )
