"""Protocol of a tab of the viewer: a name, a layout, and the data that fills it."""

from typing import Protocol

import rerun as rr
import rerun.blueprint as rrb


class Tab(Protocol):
    """One tab of the layout.

    Every view of ``layout`` shows an entity that ``send`` fills: a tab has no empty panel, it leaves the panel out.
    Entities of a tab begin with a part of their own (``reference/…``), so that tabs do not get in each other's way.
    """

    @property
    def name(self) -> str:
        """The tab's title."""

    def layout(self) -> rrb.Container:
        """Panels of the tab."""

    def send(self, stream: rr.RecordingStream) -> None:
        """Log all data of the tab, view by view, with ``timelines.set_time_point`` before each; it keeps none."""
