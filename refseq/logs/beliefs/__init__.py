"""Tables of beliefs: written, and read within bounds."""

from refseq.logs.beliefs.table import (
    LocalisedViews,
    read_beliefs,
    read_localised_views,
    write_beliefs,
)

__all__ = ["LocalisedViews", "read_beliefs", "read_localised_views", "write_beliefs"]
