"""Tabs of the viewer made from files: recordings, maps, and tables of beliefs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.drives.inputs import WHOLE, DriveSelection, read_answers, read_drive
from refseq_bench.scenarios.drives.learnt_views import place_views
from refseq_bench.scenarios.drives.viewer_recording import is_recorded, name_of, record_at
from refseq_bench.scenarios.errors import ScenarioError

if TYPE_CHECKING:
    import rerun as rr

    from refseq.belief import Belief
    from refseq.logs import Recording
    from refseq.logs.beliefs import LocalisedViews
    from refseq.map.map import Map
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.places import Places
    from refseq.viewer.tab import Tab

MAP, TABLE = ".refseq", ".parquet"


@dataclass(frozen=True)
class ViewerContent:
    """Content for the viewer: tabs from left to right, of which the last drive's is on top."""

    name: str
    tabs: "Sequence[Tab]"
    drive: "LocaliseTab | None" = None

    @property
    def all(self) -> "list[Tab]":
        """Every tab, the drive's last."""
        return [*self.tabs, *([self.drive] if self.drive else [])]

    def send(self, stream: "rr.RecordingStream") -> None:
        """Send layout and data."""
        from refseq.viewer.recording import send

        send(stream, self.all, name=self.name, active=len(self.all) - 1 if self.drive else 0)


@dataclass(frozen=True)
class RecordedContent(ViewerContent):
    """A recording of the viewer, with a layout of its own."""

    path: Path = Path()

    def send(self, stream: "rr.RecordingStream") -> None:
        """Send the file as it is."""
        stream.log_file_from_path(self.path)


@dataclass(frozen=True)
class _Files:
    """The files given, by what they are."""

    maps: list[Path] = field(default_factory=list)
    recordings: list[Path] = field(default_factory=list)
    tables: list[Path] = field(default_factory=list)

    @classmethod
    def sorted_out(cls, files: Sequence[Path]) -> "_Files":
        """Tell files apart by their endings. Raises ``ScenarioError`` for what cannot be shown together."""
        found = cls(
            [file for file in files if file.suffix == MAP],
            [file for file in files if file.suffix not in (MAP, TABLE)],
            [file for file in files if file.suffix == TABLE],
        )
        maps, recordings, tables = len(found.maps), len(found.recordings), len(found.tables)
        alone = tables == 0 and maps + recordings == 1
        together = recordings == 1 and tables >= 1 and maps in (1, tables)
        if not (alone or together):
            given = " ".join(str(file) for file in files)
            raise ScenarioError(
                f"{given}: valid is a recording, a map (.refseq), or map, recording and beliefs (.parquet): one or "
                "several tables, and one map for all or one for each"
            )
        stems = [file.stem for file in found.tables]
        if twice := sorted({stem for stem in stems if stems.count(stem) > 1}):
            raise ScenarioError(f"{twice[0]}{TABLE}: two tables have this name; valid are names of their own")
        return found


def read_content(files: Sequence[Path], reference: Path | None, selection: DriveSelection = WHOLE) -> ViewerContent:
    """Read what the files hold. Raises ``ScenarioError`` for files that do not belong together."""
    from refseq.map.map import Map
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.map.tab import MapTab

    if len(files) == 1 and is_recorded(files[0]):
        if reference is not None or selection != WHOLE:
            raise ScenarioError(f"{files[0]}: is shown as it is; valid is without --reference, --views and --thin")
        record = record_at(files[0])
        return RecordedContent(name_of(record), (), path=record)
    found = _Files.sorted_out(files)
    learnt = [Map.load(path) for path in found.maps]
    if not found.recordings:
        places = _places(found.maps[0], learnt[0], reference)
        return ViewerContent(files[0].name, [MapTab(learnt[0], places.views)])
    if not found.tables:
        return ViewerContent(files[0].name, (), LocaliseTab(read_drive(found.recordings[0], selection).views))
    if selection.views is not None or selection.thin is not None:
        raise ScenarioError("--views and --thin: beliefs tell which views they are of; valid is without")
    tables = {table: read_answers(table) for table in found.tables}
    drive = read_drive(found.recordings[0], replace(selection, times=tables[found.tables[0]].times))
    name = f"{found.maps[0].name} ← {found.recordings[0].name}"
    return _localised(name, tables, (found.maps, learnt), reference, drive)


def _localised(
    name: str,
    tables: "Mapping[Path, LocalisedViews]",
    maps: "tuple[Sequence[Path], Sequence[Map]]",
    reference: Path | None,
    drive: "Recording",
) -> ViewerContent:
    from refseq.viewer.belief_log import LocaliserLayer, beside
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.map.tab import MapTab

    learnt = maps[1]
    places = [_places(path, map_, reference) for path, map_ in zip(*maps, strict=True)]
    answers, layers = {}, []
    for number, (table, found) in enumerate(tables.items()):
        which = number if len(learnt) > 1 else 0
        answers[table.stem] = _beliefs(name, (table, found), learnt[which], drive)
        layers.append(LocaliserLayer(table.stem, tuple(answers[table.stem]), places[which]))
    tab = MapTab(learnt[0], places[0].views, drive.views, answers[next(iter(tables)).stem])
    return ViewerContent(name, [tab], LocaliseTab(drive.views, beside(layers), answers))


def _beliefs(
    name: str, answers: "tuple[Path, LocalisedViews]", learnt: "Map", drive: "Recording"
) -> "Mapping[str, Sequence[Belief]]":
    """The answers of a table. Raises ``ScenarioError`` for those that fit neither drive nor map."""
    from refseq_bench.scenarios.drives.evaluate import comparison_of

    table, found = answers
    if [round(time, 6) for time in found.times] != [round(view.time, 6) for view in drive.views]:
        raise ScenarioError(f"{table}: answers other views than the first table; valid is a table of the same views")
    try:
        return comparison_of(name, learnt, drive, found.beliefs).beliefs
    except ScenarioError as error:
        raise ScenarioError(f"{table}: {error}") from error


def _places(path: Path, learnt: "Map", reference: Path | None) -> "Places":
    """The places of a map, with the pictures of its drive."""
    from refseq.viewer.places import Places

    return Places.of(learnt, place_views(learnt, path, reference) if reference else ())
