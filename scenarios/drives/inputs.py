"""Read recordings, maps and beliefs; check names and files; a mistake is told in one line."""

import fcntl
import hashlib
import logging
import math
import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from refseq.files import followed, open_input
from refseq_bench.scenarios.drives.left_out import views_left_out
from refseq_bench.scenarios.errors import ScenarioError, UnwritableError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from refseq.belief import Stage
    from refseq.logs import LogSource, PairingOptions, Recording, ViewPlan
    from refseq.logs.beliefs import LocalisedViews
    from refseq.logs.trajectories import PoseTable
    from refseq.map.map import Map
    from refseq.view import Scan


@dataclass(frozen=True, slots=True)
class DriveSelection:
    """Part of a recording that is read, and how: the library's side of the options that commands share.

    ``views`` is FROM:TO, counted before thinning; ``thin`` keeps one view every so far [m]; ``noise_seed`` adds noise
    to the odometry. ``odometry`` and ``truth`` are a topic of the log, or a trajectory's file; behind a comma the file
    of its times. ``topics`` are pairs NAME=TOPIC, commas between: the names of sensors and their topics. Samples within
    ``tolerance`` [s] make one view; ``late`` are pairs NAME=SECONDS: how late a sensor's stamps are, or the truth's.
    ``times`` [s] are those of the very views, as beliefs tell them. None leaves all as it is.
    """

    views: str | None = None
    thin: float | None = None
    times: tuple[float, ...] | None = None
    noise_seed: int | None = None
    odometry: str | None = None
    truth: str | None = None
    topics: str | None = None
    tolerance: float | None = None
    late: str | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths that ``odometry`` and ``truth`` name; where they name topics, of no file."""
        named = ",".join(filter(None, (self.odometry, self.truth)))
        return tuple(Path(name) for name in named.split(",") if name)


WHOLE = DriveSelection()
"""All views, as they were recorded."""


def words(text: str | None, what: str) -> tuple[str, ...] | None:
    """Words with commas between; None is left as it is."""
    if text is None:
        return None
    found = tuple(word.strip() for word in text.split(","))
    if not all(found):
        raise ScenarioError(f"{what} {text!r}: a name is empty; valid are names with commas between")
    _check_once(found, f"{what} {text!r}")
    return found


def _check_once(names: Sequence[str], place: str) -> None:
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ScenarioError(f"{place}: {twice[0]} is named twice; valid is once")


def assignments(texts: Sequence[str] | None, what: str) -> dict[str, str]:
    """Pairs written as NAME=VALUE."""
    for text in texts or ():
        if not all(text.partition("=")):
            raise ScenarioError(f"{what} {text!r}: valid is a name, '=' and a value")
    _check_once([text.partition("=")[0] for text in texts or ()], f"{what} {', '.join(texts or ())!r}")
    return dict(text.split("=", 1) for text in texts or ())


def stages(names: Sequence[str] | None) -> "tuple[Stage, ...]":
    """Stages by their names, each once; without names all of them."""
    from refseq.belief import Stage

    for name in names or ():
        if name not in set(Stage):
            raise ScenarioError(f"stage {name!r} is unknown; valid are {', '.join(Stage)}")
    return tuple(Stage(name) for name in dict.fromkeys(names or Stage))


def check_output(*paths: Path | None, of: Iterable[Path | None] = (), making: bool = False) -> None:
    """Tell before the work begins that a result could not be written, or would overwrite a file that it is made of.

    None: none is asked for, or none is there. ``making``: folders that are missing will be made.
    """
    check_spared(*paths, of=of)
    for path in filter(None, paths):
        if path.exists() and not path.is_file():
            kind = "folder" if path.is_dir() else "device, pipe or socket"
            raise ScenarioError(f"{path}: is a {kind}; valid is the name of a file to write")
        check_room(path, making=making)


def check_room(path: Path, *, making: bool = False) -> None:
    """Tell before the work begins that nothing could be made by the name ``path``; nothing stays."""
    with writing(path):
        folder = followed(path).parent
    if making:
        folder = _nearest(folder)
    if not folder.is_dir():
        found = f"{folder} is no folder" if os.path.lexists(folder) else f"there is no folder {folder}"
        raise ScenarioError(f"{path}: cannot be written: {found}")
    _check_access(path, folder)


def _nearest(path: Path) -> Path:
    """The path, or what there is of the way to it; a link to nothing is there."""
    return next(one for one in (path, *path.parents) if os.path.lexists(one))


def check_spared(*paths: Path | None, of: Iterable[Path | None]) -> None:
    """Tell before the work begins that a result would overwrite a file that it is made of, by whatever name."""
    sources = [one for one in of if one is not None and one.exists()]
    for path in filter(None, paths):
        if path.exists() and (source := next((one for one in sources if one.samefile(path)), None)) is not None:
            raise ScenarioError(f"{path}: would overwrite {source}; valid is another name")


def check_new(path: Path) -> None:
    """Tell that a text to be edited would be written over one that may have been."""
    check_output(path)
    if path.exists():
        raise ScenarioError(f"{path}: is there already; valid is a new file")


def check_beside(source: Path, target: Path) -> None:
    """Tell that a result would overwrite what it is made of, or lie within it."""
    made, of = target.resolve(), source.resolve()
    if made == of or of in made.parents or made in of.parents:
        raise ScenarioError(f"{target}: would overwrite {source}; valid is another name")


def check_folder(path: Path) -> None:
    """Tell before the work begins that a folder could not be made or filled; nothing stays made."""
    there = _nearest(path)
    if not there.is_dir():
        named = "" if there == path else f"{there} "
        raise ScenarioError(f"{path}: {named}is no folder; valid is the name of a folder to fill")
    _check_access(path, there)


def _check_access(path: Path, folder: Path) -> None:
    """Raise ``ScenarioError`` where nothing can be made in the ``folder`` that is to hold ``path``; nothing stays."""
    try:
        with TemporaryDirectory(dir=folder, prefix=".refseq-"):  # permissions tell nothing of /proc and the like
            pass
    except OSError:
        raise ScenarioError(f"{path}: cannot be written: no write access to folder {folder}") from None


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Tell in one line what keeps ``path`` from being written, a full disk for one; raises ``UnwritableError``."""
    try:
        yield
    except OSError as error:
        raise UnwritableError(f"{path}: cannot be written: {error.strerror or error}") from error


def replacement(path: Path, of: Iterable[Path]) -> AbstractContextManager[None]:
    """Make ready to write a result over a file that it is made ``of``: call it before that is read, enter it to write.

    Entering raises ``ScenarioError`` where the file is another by then: what somebody else wrote would be lost. Where
    ``path`` is none of the files read, anything may be replaced.
    """
    if not any(path.exists() and one.exists() and path.samefile(one) for one in of):
        return nullcontext()
    return _unchanged(path, _digest(path))


@contextmanager
def _unchanged(path: Path, digest: bytes | None) -> Iterator[None]:
    """Hold a file against other commands that would replace it so, and see that it is the one that was read.

    The lock is on the file that has the name now. Whoever waited for it finds another by that name, and is told so.
    """
    changed = ScenarioError(f"{path}: has changed since it was read; valid is to run the command again")
    try:
        file = open_input(path)
    except OSError:
        raise changed from None
    with file:
        with suppress(OSError):  # some file systems have no locks
            fcntl.flock(file, fcntl.LOCK_EX)
        if _digest(path) != digest:
            raise changed
        yield


def _digest(path: Path) -> bytes | None:
    """A file's content in short; None of one that cannot be read."""
    with suppress(OSError), open_input(path) as file:
        return hashlib.sha256(file.read()).digest()
    return None


def read_drive(path: Path, selection: DriveSelection = WHOLE, sensors: Collection[str] | None = None) -> "Recording":
    """Read a log, keep the views asked for, and thin them; only pictures of views that stay are decoded.

    Where all ``sensors`` are in it, what others saw is not read: it may be damaged.
    """
    from refseq.dead_reckoning import way_along
    from refseq.health.pictures import picture_doubt
    from refseq.logs import open_log
    from refseq.logs.closing import incomplete, noted_damage
    from refseq.view import LASER
    from refseq_bench.scenarios.drives.odometry_doubts import laser_doubt

    source = open_log(path)
    plan = thinned_drive(source, selection)
    if sensors is not None and set(sensors) <= set(plan.findings.sensors.values()):
        plan = plan.seen_by(sensors)
    recording = plan.recording()
    if selection.times is None:
        views = recording.views
        if told := laser_doubt(_some_scans(recording), views, lambda of: [views[number].scan for number in of]):
            _more_by_check(source, f"{LASER}: {told}")
        for camera in sorted(recording.sensors - {LASER}) if way_along(views)[-1] > SHORT else ():
            if told := picture_doubt(_some_pictures(recording, camera)):
                _more_by_check(source, f"{camera}: {told}")
    unwhole = {} if recording.complete or noted_damage(recording.metadata) else incomplete(source.damage)
    return replace(
        recording, metadata={**recording.metadata, **origin_notes(selection), **unwhole, **views_left_out(recording)}
    )


FEW = 8
"""Scans, spread over a drive, that tell of its unit, and pictures that tell whether they show its way."""

SHORT = 1.0
"""Over a shorter way all pictures may be the same [m]."""


def _some_scans(recording: "Recording") -> "list[Scan]":
    scans = [view.scan for view in recording.views if view.scan is not None]
    return scans[:: max(1, len(scans) // FEW)]


def _some_pictures(recording: "Recording", camera: str) -> "Iterator[NDArray[np.uint8]]":
    views = [view for view in recording.views if camera in view.images]
    return (view.images[camera] for view in views[:: max(1, len(views) // FEW)])


def origin_notes(selection: DriveSelection) -> dict[str, str]:
    """Notes on a drive whose odometry or true poses are given beside its log: where they come from."""
    given = {"odometry": selection.odometry, "truth": selection.truth}
    return {key: Path(name).name for key, name in given.items() if name is not None}


def load_map(path: Path) -> "Map":
    """Load a map, and tell of drives that ended before their time. Raises as ``read_map`` does."""
    from refseq.logs.closing import noted_damage

    map_ = read_map(path, "is it in the log's place?")
    for name, sequence in zip(map_.names, map_.sequences, strict=True):
        if damage := noted_damage(sequence.metadata):
            logging.getLogger(__name__).warning("%s: %s was learnt from an incomplete drive (%s)", path, name, damage)
    return map_


def read_map(path: Path, advice: str = "make it by `refseq learn`") -> "Map":
    """Load a map. Raises ``MapError``, and ``ScenarioError`` with ``advice`` for a log."""
    from refseq.errors import MapError
    from refseq.map.map import Map

    try:
        return Map.load(path)
    except MapError as error:
        if kind := _kind_of_log(path):
            raise ScenarioError(f"{path}: is a log ({kind}), no map; valid is a map (.refseq): {advice}") from error
        raise


def _kind_of_log(path: Path) -> str:
    """The kind of a log that views could be made of; empty for anything else, as any text may be a CARMEN log."""
    from refseq.errors import LogError
    from refseq.logs import Role, open_log

    try:
        source = open_log(path)
        return source.kind if any(one.role in (Role.CAMERA, Role.LASER) for one in source.channels) else ""
    except LogError:
        return ""


def thinned_drive(source: "LogSource", selection: DriveSelection = WHOLE) -> "ViewPlan":
    """Plan the views that are asked for and stay after thinning; no picture is decoded."""
    import numpy as np

    from refseq.view import ASSUMED
    from refseq_bench.scenarios.drives.odometry_doubts import course_doubts, odometry_doubts
    from refseq_bench.scenarios.drives.truth.fit import check_truth
    from refseq_bench.scenarios.drives.truth.repeated import repeats_odometry

    plan = plan_drive(source, selection)
    if not source.complete:
        logging.getLogger(__name__).warning(
            "%s is incomplete (%s); its %d views are used", source.path, source.damage, len(plan)
        )
    assumed = selection.odometry is None and source.metadata.get("odometry", "").startswith(ASSUMED)
    if assumed:
        logging.getLogger(__name__).warning("%s has no odometry: %s", source.path, source.metadata["odometry"])
    # Before the truth is held against it, which may be refused for what is wrong with the odometry.
    if selection.times is None and plan.views and not assumed:
        for told in (*odometry_doubts(plan.views, plan.views[0].time), *course_doubts(plan)):
            _more_by_check(source, told)
    # What beliefs were made of, `localise` has said: it may have been noisy.
    if selection.truth is not None and selection.times is None and not assumed:
        check_truth(plan.views, selection.truth, source.path.name, truth_delay(selection))
    if selection.noise_seed is None and selection.times is None and repeats_odometry(plan.views):
        logging.getLogger(__name__).warning(
            "%s: its true poses are its odometry told twice; a score says how odometry agrees, unless a map corrected "
            "both",
            source.path,
        )
    if selection.times is None:
        for told in _left_out(plan):
            _more_by_check(source, told)
    if selection.noise_seed is not None:
        plan = plan.with_noise(np.random.default_rng(selection.noise_seed))
    return plan.thinned(selection.thin) if selection.thin else plan


def _more_by_check(source: "LogSource", told: str) -> None:
    logging.getLogger(__name__).warning("%s: %s; `refseq log check` tells more", source.path, told)


MUCH = 0.2
"""A share of a log's moments that is too much to be left out without a word."""


def _left_out(plan: "ViewPlan") -> "Iterator[str]":
    """Sentences on what of a log is in no view."""
    from refseq.logs.pairing.moments import NONE
    from refseq_bench.scenarios.drives.odometry_doubts import size_doubts

    found = plan.findings
    moments = found.views + found.without_odometry
    if found.without_odometry > MUCH * moments:
        yield f"{found.without_odometry} of {moments} moments have no odometry, and are no views"
    yield from (note for note in found.notes if note.startswith("times are"))
    yield from found.losses()
    yield from size_doubts(plan)
    for topic, sensor in found.sensors.items():
        if (plan.moments.samples[topic] == NONE).all() and not found.damaged.get(sensor):
            yield f"{sensor} ({topic}) is in no view, as its stamps are none of the views'"


def plan_drive(source: "LogSource", selection: DriveSelection = WHOLE) -> "ViewPlan":
    """Plan the views asked for, without thinning them; no picture is decoded."""
    from refseq.logs import plan_views
    from refseq_bench.scenarios.drives.selection import stretch

    if selection.thin is not None and not math.isfinite(selection.thin):
        raise ScenarioError(f"thin {selection.thin} is not valid; valid is a finite number of 0 or more [METRES]")
    plan = plan_views(source, pairing_options(selection))
    if selection.times is not None:
        return plan.at(selection.times)
    return plan.between(stretch(selection.views, len(plan), source.path))


def pairing_options(selection: DriveSelection) -> "PairingOptions":
    """Topics and trajectories of a selection."""
    from refseq.logs import PairingOptions
    from refseq_bench.scenarios.drives.selection import names_by_topic

    tolerance = selection.tolerance
    if tolerance is not None and not 0 <= tolerance < math.inf:
        raise ScenarioError(f"tolerance {tolerance} is not valid; valid is a finite number of 0 or more [SECONDS]")
    return PairingOptions(
        names=names_by_topic(assignments(words(selection.topics, "topics"), "topics")),
        tolerance=tolerance,
        late=delays(selection),
        odometry=_poses_of(selection.odometry, "odometry"),
        truth=_poses_of(selection.truth, "truth"),
    )


def delays(selection: DriveSelection) -> dict[str, float]:
    """Names of sensors, or ``truth``, and by how much their stamps are late [s], as a selection tells."""
    from refseq.logs.trajectories.fields import DECIMAL_COMMA

    # Behind a comma that parts two sensors stands a name.
    if written := re.search(rf"=({DECIMAL_COMMA.pattern})(?=,|$)", selection.late or ""):
        raise ScenarioError(f"late {written[1]!r} has a decimal comma; valid are decimal points, as laser=0.12 [s]")
    return {name: _seconds(text) for name, text in assignments(words(selection.late, "late"), "late").items()}


def truth_delay(selection: DriveSelection) -> float:
    """Seconds by which the stamps of the true poses are told to be late."""
    from refseq.logs import Role

    return delays(selection).get(Role.TRUTH, 0.0)


def _seconds(text: str) -> float:
    from refseq.limits import SECONDS

    try:
        late = float(text)
    except ValueError:
        raise ScenarioError(f"late {text!r} is no number; valid are pairs as laser=0.12 [s]") from None
    if not abs(late) <= SECONDS:
        raise ScenarioError(f"late {text!r} is not valid; valid are numbers up to {int(SECONDS)} either way [SECONDS]")
    return late


def _poses_of(asked: str | None, what: str) -> "str | PoseTable | None":
    """A topic as it is, or the trajectory in a file; topics begin with a stroke, and no file is called like them."""
    from refseq.logs.trajectories import read_trajectory

    if asked is None:
        return None
    names = [Path(name) for name in asked.split(",")]
    if len(names) == 1 and asked.startswith("/") and not names[0].exists():
        return asked
    for name in names:
        if not name.is_file():
            raise ScenarioError(f"--{what} {name}: is no file; valid is a trajectory's file, or a topic as /{what}")
    if len(names) > 2:
        raise ScenarioError(f"--{what} {asked}: is {len(names)} files; valid are a trajectory and that of its times")
    return read_trajectory(*names)


def read_answers(beliefs: Path) -> "LocalisedViews":
    """A table of beliefs that holds at least one."""
    from refseq.logs.beliefs import read_localised_views

    if not beliefs.is_file():
        raise ScenarioError(f"{beliefs}: is no file; valid is a table of beliefs (.parquet)")
    found = read_localised_views(beliefs)
    if not found.beliefs:
        raise ScenarioError(f"{beliefs}: holds no belief; valid is one a view of the recording")
    return found
