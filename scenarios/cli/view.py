"""``refseq view``: any recording, map or atlas in the Rerun viewer, and what localisers made of a drive."""

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import out, say
from scenarios.cli.options import Thin, Views
from scenarios.drives.inputs import check_folder, check_output, read_drive, writing
from scenarios.drives.viewer_recording import is_recorded, name_of, record_at
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    import rerun as rr

    from refseq.belief import Belief
    from refseq.logs import Recording
    from refseq.map.map import Map
    from refseq.view import View
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.places import Places
    from refseq.viewer.tab import Tab

EXAMPLES = """Examples:

* `refseq view query.mcap`
* `refseq view map.refseq query.mcap beliefs.parquet --reference reference.mcap --save show.rrd`
* `refseq view map.refseq query.mcap best.parquet thesis.parquet --layers show`
* `refseq view atlas.refseq query.mcap beliefs.parquet --serve 9090`
* `refseq view out/second-door`"""
MAP, TABLE = ".refseq", ".parquet"


def view(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILES",
            help="A recording; a map or an atlas; map, recording and beliefs (.parquet); a mission's folder; an .rrd.",
        ),
    ],
    reference: Annotated[Path | None, typer.Option(metavar="FILE", help="First drive, for its pictures.")] = None,
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a file for the Rerun viewer (.rrd) and open none.")
    ] = None,
    layers: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write the drive, and each table's answers, to files (.rrd) of their own."),
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Send it to a viewer that runs elsewhere: rerun+http://HOST:9876/proxy."),
    ] = None,
    serve: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=1, max=65535, help="Serve it to browsers on this machine alone, until Ctrl-C."
        ),
    ] = None,
    memory_limit: Annotated[
        str,
        typer.Option(
            metavar="LIMIT", help="Memory of a viewer started or served, 4GB or 50%; then the oldest is dropped."
        ),
    ] = "50%",
    views: Views = None,
    thin: Thin = None,
) -> None:
    """Show a drive, a map, or a localised drive in the Rerun viewer, which is started unless told otherwise."""
    given = {"--save": save, "--layers": layers, "--connect": connect, "--serve": serve}
    if len(chosen := [option for option, value in given.items() if value is not None]) > 1:
        raise ScenarioError(f"{' and '.join(chosen)}: valid is one of them, or none")
    # Rerun tells on the terminal what goes wrong in its own words and several lines; ours is one line.
    os.environ.setdefault("RUST_LOG", "off")
    _check_outlet(save, layers, connect, serve)
    shown = read_shown(files, reference, views, thin)
    if save is not None:
        _save(shown, save)
    elif layers is not None:
        _save_layers(shown, layers)
    else:
        with _viewer(shown.name, connect, serve, memory_limit) as stream:
            shown.send(stream)


def _check_outlet(save: Path | None, layers: Path | None, url: str | None, port: int | None) -> None:
    """Tell before anything is read that it could not be shown."""
    from refseq.viewer.sinks import check_answers, check_display, check_free

    if save is not None:
        check_output(save)
    elif layers is not None:
        check_folder(layers)
    elif url is not None:
        check_answers(url)
    elif port is not None:
        check_free(port)
    else:
        check_display()


@dataclass(frozen=True)
class Shown:
    """What is to be shown: tabs from left to right, of which the last drive's is on top."""

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
class Recorded(Shown):
    """What was recorded for the viewer before, with a layout of its own."""

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


def read_shown(files: Sequence[Path], reference: Path | None, views: str | None, thin: float | None) -> Shown:
    """Read what the files hold. Raises ``ScenarioError`` for files that do not belong together."""
    from refseq.map.map import Map
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.map.tab import MapTab

    if len(files) == 1 and is_recorded(files[0]):
        if reference is not None or views is not None or thin is not None:
            raise ScenarioError(f"{files[0]}: is shown as it is; valid is without --reference, --views and --thin")
        record = record_at(files[0])
        return Recorded(name_of(record), (), path=record)
    found = _Files.sorted_out(files)
    learnt = [Map.load(path) for path in found.maps]
    first = read_drive(reference, None, None).views if reference else ()
    if not found.recordings:
        places = _places(found.maps[0], learnt[0], reference, first)
        return Shown(files[0].name, [MapTab(learnt[0], places.views)])
    drive = read_drive(found.recordings[0], views, thin)
    if not found.tables:
        return Shown(files[0].name, (), LocaliseTab(drive.views))
    name = f"{found.maps[0].name} ← {found.recordings[0].name}"
    return _localised(name, found, learnt, (reference, first), drive)


def _localised(
    name: str,
    files: _Files,
    learnt: "Sequence[Map]",
    reference: "tuple[Path | None, Sequence[View]]",
    drive: "Recording",
) -> Shown:
    from refseq.viewer.belief_log import LocaliserLayer, beside
    from refseq.viewer.localise_tab import LocaliseTab
    from refseq.viewer.map.tab import MapTab

    places = [_places(path, map_, *reference) for path, map_ in zip(files.maps, learnt, strict=True)]
    answers, layers = {}, []
    for number, table in enumerate(files.tables):
        which = number if len(learnt) > 1 else 0
        answers[table.stem] = _beliefs(name, table, learnt[which], drive)
        layers.append(LocaliserLayer(table.stem, tuple(answers[table.stem]), places[which]))
    tab = MapTab(learnt[0], places[0].views, drive.views, answers[files.tables[0].stem])
    return Shown(name, [tab], LocaliseTab(drive.views, beside(layers), answers))


def _beliefs(name: str, table: Path, learnt: "Map", drive: "Recording") -> "Mapping[str, Sequence[Belief]]":
    """The answers of a table. Raises ``ScenarioError`` for those that fit neither drive nor map."""
    from refseq.logs.beliefs import read_beliefs
    from scenarios.drives.evaluate import comparison_of

    if not table.is_file():
        raise ScenarioError(f"{table}: is no file; valid is a table of beliefs (.parquet)")
    found = read_beliefs(table)
    if not found:
        raise ScenarioError(f"{table}: holds no belief; valid is one a view of the recording")
    try:
        return comparison_of(name, learnt, drive, found).beliefs
    except ScenarioError as error:
        raise ScenarioError(f"{table}: {error}") from error


def _places(path: Path, learnt: "Map", reference: Path | None, views: "Sequence[View]") -> "Places":
    """The places of a map, with the pictures of its drive."""
    from refseq.viewer.places import Places

    if reference is not None and len(views) != len(learnt):
        raise ScenarioError(
            f"{reference}: has {len(views)} views, {path} has {len(learnt)} places; valid is the drive it was learnt "
            "from, or no reference for an atlas or a reduced map"
        )
    return Places.of(learnt, views)


# --- where it goes ---


def _save(shown: Shown, path: Path) -> None:
    from refseq.viewer.recording import saved

    with writing(path), saved(path, shown.name) as stream:
        shown.send(stream)
    say(out, f"{path}: open it with 'rerun {path}'")


def _save_layers(shown: Shown, folder: Path) -> None:
    from refseq.viewer.layers import write_layers

    if shown.drive is None or not shown.drive.layers:
        raise ScenarioError(
            "--layers: there is no localiser's answer to put beside a drive; valid is map, recording and beliefs "
            f"({TABLE}), or --save"
        )
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        paths = write_layers(folder, shown.drive, shown.tabs, name=shown.name)
    say(out, f"{folder}: open any of them together with 'rerun {' '.join(str(path) for path in paths)}'")


@contextmanager
def _viewer(name: str, url: str | None, port: int | None, memory: str) -> "Iterator[rr.RecordingStream]":
    """A stream to a viewer elsewhere, to browsers, or to one that is started here."""
    from refseq.viewer.sinks import connected, served, spawned

    if url is not None:
        with connected(url, name) as stream:
            yield stream
        say(out, f"{name}: sent to {url}")
    elif port is not None:
        with served(port, name, memory) as (stream, page):
            yield stream
            say(out, f"{name}: open {page} in a browser of this machine; Ctrl-C ends it")
            _until_interrupted()
    else:
        with spawned(name, memory) as stream:
            yield stream


def _until_interrupted() -> None:
    """Wait for Ctrl-C, the ordinary end of serving."""
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        return
