"""The index of a campaign: its verdicts, and the way to each case."""

from collections.abc import Sequence

from refseq_bench.scenarios.campaign.declare.outcomes import VERDICTS
from refseq_bench.scenarios.campaign.pages.decisive import corrected, power_line, power_rows
from refseq_bench.scenarios.campaign.pages.sweep_plot import SweepPlot
from refseq_bench.scenarios.campaign.pages.verdicts import index_row, verdict_line
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord
from refseq_bench.scenarios.report.page import rendered
from refseq_bench.scenarios.report.words import duration_text


def index_page(record: CampaignRecord, sweep_plots: Sequence[SweepPlot]) -> str:
    """The page of a campaign."""
    blocking = [case for case in record.cases if case.blocking]
    others = [case for case in record.cases if not case.blocking]
    comparisons = corrected(record)
    return rendered(
        "campaign.html.j2",
        title=f"Campaign: {verdict_line(record)}",
        groups=[
            (heading, [index_row(case) for case in cases])
            for heading, cases in (("Cases that decide", blocking), ("Not blocking", others))
            if cases
        ],
        campaign=record,
        verdicts=VERDICTS,
        seconds=duration_text(record.seconds),
        sweep_plots=sweep_plots,
        power_line=power_line(comparisons),
        power=power_rows(record.cases, comparisons),
    )
