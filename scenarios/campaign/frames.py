"""Frames of a campaign's drives: read from the store again, one drive after the other."""

from collections.abc import Sequence

from scenarios.campaign.store import Store
from scenarios.campaign.tasks import AnswerTask, asked_views, learnt_views
from scenarios.section_frames import Encoded, Side, Wanted, encoded


class FromStore:
    """Frames that lie in the store, of runs by their ``tasks``; all drives at once would fill the memory."""

    def __init__(self, tasks: Sequence[AnswerTask], store: Store) -> None:
        self._tasks, self._store = tasks, store

    def __call__(self, wanted: Sequence[Wanted]) -> Encoded:
        """The frames of some views, by camera."""
        found: dict[Wanted, dict[str, str]] = {}
        for run, side in dict.fromkeys((one.run, one.side) for one in wanted):
            read = learnt_views if side is Side.REFERENCE else asked_views
            views = read(self._tasks[run], self._store).views
            found |= encoded(views, [one for one in wanted if (one.run, one.side) == (run, side)])
        return found
