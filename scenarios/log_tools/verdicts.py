"""Verdicts on a log: how far it serves for learning, localising and scoring, and the command to type next."""

import os
import shlex
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import way_along
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.thin import thinned
from refseq_bench.scenarios.drives.inputs import DriveSelection
from refseq_bench.scenarios.drives.odometry_doubts import OdometryJump
from refseq_bench.scenarios.log_tools.clocks.late import late_words
from refseq_bench.scenarios.log_tools.splitting import DriveSplit, split_of
from refseq_bench.scenarios.log_tools.survey import motion_origin
from refseq_bench.scenarios.log_tools.travel import Travel
from refseq_bench.scenarios.tables import plural

FEW_VIEWS = 10
"""A map of fewer views has hardly an order of views to live by."""

SHORT = 1.0
"""A way shorter than this is one place [m]."""

WORTH_SPLITTING = 0.05
"""Share of the path that has to be driven twice before it is worth to localise the one part in the other."""

OF_ANOTHER = "; `refseq log check SECOND` tells those of that one"
"""Said where a second log is localised: a clock that was never set begins anew with each drive."""

TRAJECTORIES = "a table with a header as time,x,y,heading [rad], TUM, KITTI or EuRoC"
"""Files of poses that commands take, the plainest first."""

PROFILE = "best"
"""The profile to learn by: on logs of others it is right more often than the thesis', with any sensors."""


class Usability(StrEnum):
    """Degrees in which a log serves for a task."""

    WORKS = "works"
    LIMITED = "works, with less"
    FAILS = "does not work"


@dataclass(frozen=True, slots=True)
class LogVerdict:
    """A task, how far the log serves for it and why, and the commands to type next, none where none helps."""

    task: str
    usability: Usability
    reason: str
    commands: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Prospect:
    """All that the verdicts are about: the log, its views before and after thinning, and how they were selected.

    ``plan`` is None where no view comes of the log, for the reason in ``refusal``; ``views`` counts those that stay
    after thinning by ``selection``. ``places`` (n, 3) are x, y [m] and heading [rad] of those before, nan where they
    are not known. ``truth_is_odometry``: both are the same path, told twice. ``troubles`` are those
    of sensors that cannot be learnt, by name (``troubles_of``), ``jumps`` those of the odometry. ``late`` sensors, by
    name, have clocks that ``selection`` sets right by so much [s]. ``truth_doubted``: something speaks against the true
    poses, as the warnings tell. ``units`` is the doubt that odometry is in metres; ``headings_doubted``: its headings
    contradict its path, as the warnings tell.
    """

    path: Path
    selection: DriveSelection
    plan: ViewPlan | None
    refusal: str
    views: int
    travel: Travel
    places: NDArray[np.float64]
    truth_is_odometry: bool = False
    troubles: Mapping[str, str] = field(default_factory=dict)
    jumps: Sequence[OdometryJump] = ()
    late: Mapping[str, float] = field(default_factory=dict)
    truth_doubted: bool = False
    units: str = ""
    headings_doubted: bool = False

    @property
    def well(self) -> tuple[str, ...]:
        """Sensors without trouble."""
        sensors = self.plan.findings.sensors.values() if self.plan else ()
        return tuple(sorted(set(sensors) - set(self.troubles)))

    @property
    def trouble(self) -> str:
        """The troubles in one sentence; empty without any."""
        told = "; ".join(f"{name}: {why}" for name, why in self.troubles.items())
        return f"{told}; by {', '.join(self.well)} alone" if told and self.well else told

    @property
    def length(self) -> float:
        """Way by the odometer [m]."""
        return self.travel.length


def verdicts(prospect: Prospect) -> tuple[LogVerdict, ...]:
    """Judge a log for each of the tasks."""
    learn, localise = (
        _by_clocks(prospect, _by_headings(prospect, one)) for one in (_learn(prospect), _localise(prospect))
    )
    return (learn, localise, _score(prospect))


def _by_clocks(of: Prospect, verdict: LogVerdict) -> LogVerdict:
    """The verdict, with what has to be typed for clocks that differ."""
    if not of.late or verdict.usability is Usability.FAILS:
        return verdict
    other = any("SECOND" in command for command in verdict.commands)
    more = f", with --late {','.join(late_words(of.late))} as its clocks differ{OF_ANOTHER if other else ''}"
    return replace(verdict, reason=f"{verdict.reason}{more}")


def _by_headings(of: Prospect, verdict: LogVerdict) -> LogVerdict:
    """The verdict, with less where headings contradict the path: ways and turns come out wrong."""
    if not of.headings_doubted or verdict.usability is Usability.FAILS:
        return verdict
    reason = f"the odometry's headings contradict its path, as told under 'look at'; {verdict.reason}"
    return replace(verdict, usability=Usability.LIMITED, reason=reason)


def _learn(of: Prospect) -> LogVerdict:
    if of.plan is None:
        return LogVerdict("learn", Usability.FAILS, of.refusal)
    if not motion_origin(of.plan.findings):
        reason = f"no odometry: give it as a trajectory ({TRAJECTORIES})"
        return LogVerdict("learn", Usability.FAILS, reason, _commands(of, "check", more="--odometry FILE"))
    if of.units:
        return LogVerdict("learn", Usability.FAILS, _units(of))
    if of.length < SHORT:
        return LogVerdict("learn", Usability.FAILS, _hardly_moves(of, of.plan))
    if of.troubles and not of.well:
        return LogVerdict("learn", Usability.FAILS, of.trouble)
    if of.jumps:
        reason, stretch = "the odometry jumps: learn a stretch between jumps", _longest(of.plan, of.jumps)
        return LogVerdict("learn", Usability.LIMITED, reason, _commands(of, "stretch", more=stretch))
    if of.troubles:
        return LogVerdict("learn", Usability.LIMITED, of.trouble, _commands(of, "learn"))
    if of.views < FEW_VIEWS:
        reason = f"{plural(of.views, 'view')} over {of.length:.1f} m: hardly an order of views to go by"
        return LogVerdict("learn", Usability.LIMITED, reason, _commands(of, "learn"))
    return LogVerdict("learn", Usability.WORKS, f"{of.views} places over {of.length:.1f} m", _commands(of, "learn"))


def _localise(of: Prospect) -> LogVerdict:
    if of.plan is None:
        return LogVerdict("localise", Usability.FAILS, of.refusal)
    if not motion_origin(of.plan.findings):
        reason = "no odometry: each view is judged by itself (stage uniform), in a map of another log"
        return LogVerdict("localise", Usability.LIMITED, reason, _commands(of, "alone"))
    if of.units:
        return LogVerdict("localise", Usability.FAILS, _units(of))
    if of.troubles and not of.well:
        return LogVerdict("localise", Usability.FAILS, of.trouble)
    if of.length < SHORT:
        reason = f"in a map of another drive; {_hardly_moves(of, of.plan)}"
        return LogVerdict("localise", Usability.LIMITED, reason, _commands(of, "in a map"))
    jumps = "the odometry jumps, where the robot seems to have been carried; " if of.jumps else ""
    trouble = f"{of.trouble}; {jumps}" if of.troubles else jumps
    usability = Usability.LIMITED if trouble else Usability.WORKS
    if split := _split(of, of.plan):
        reason = (
            f"{trouble}{100 * of.travel.revisited:.0f} % of the path is driven twice: learn the first part, ask the "
            f"rest, {split.on_map} of whose {split.asked} views are on that map"
        )
        return LogVerdict("localise", usability, reason, _commands(of, "localise", split.cut))
    reason = f"{trouble}in a map of another drive along the same path"
    return LogVerdict("localise", usability, reason, _commands(of, "localise"))


def _units(of: Prospect) -> str:
    return f"{of.units} A table names another unit in its header: x [mm]" if of.selection.odometry else of.units


def _longest(plan: ViewPlan, jumps: Sequence[OdometryJump]) -> str:
    """The longest stretch between jumps, as an option."""
    begins = [0, *(jump.view for jump in jumps)]
    ends = [*(jump.view - jump.steps + 1 for jump in jumps), len(plan)]
    stretches = list(zip(begins, ends, strict=True))
    ways = [sum(abs(view.distance) for view in plan.views[low + 1 : high]) for low, high in stretches]
    low, high = stretches[int(np.argmax(ways))]
    return f"--views {low}:{high}"


def _hardly_moves(of: Prospect, plan: ViewPlan) -> str:
    origin = motion_origin(plan.findings)
    return f"the robot hardly moves: {of.length:.2f} m by the poses of {origin}; velocities are not read"


def _score(of: Prospect) -> LogVerdict:
    if of.plan is None:
        return LogVerdict("score", Usability.FAILS, of.refusal)
    findings = of.plan.findings
    if not findings.truth:
        reason = f"no true poses: beliefs and a report without score; give truth as a trajectory ({TRAJECTORIES})"
        return LogVerdict("score", Usability.LIMITED, reason, _commands(of, "check", more="--truth FILE"))
    if of.truth_is_odometry:
        reason = (
            "truth and odometry are the same poses: either mapped poses replaced the odometry (then learn and localise "
            "with --odometry-noise), or there is no truth: give it as a trajectory"
        )
        noisy = _commands(of, "learn", more="--odometry-noise") if motion_origin(findings) else ()
        return LogVerdict("score", Usability.LIMITED, reason, (*noisy, *_commands(of, "check", more="--truth FILE")))
    if of.truth_doubted:
        reason = f"true poses from {findings.truth}, of which there is a doubt to look at"
        return LogVerdict("score", Usability.LIMITED, reason)
    if findings.without_truth:
        reason = f"{findings.views - findings.without_truth} of {findings.views} views have a true pose"
        return LogVerdict("score", Usability.LIMITED, reason)
    return LogVerdict("score", Usability.WORKS, f"true poses from {findings.truth}")


def _split(of: Prospect, plan: ViewPlan) -> DriveSplit | None:
    """The drive cut in two for commands, by its views before thinning; None if it comes back to itself too little."""
    if of.selection.views is not None or of.travel.revisited < WORTH_SPLITTING:
        return None
    thin = of.selection.thin
    kept = np.array(thinned(plan.views, thin)[0]) if thin else np.arange(len(plan))
    along = way_along(plan.views)
    found = split_of(of.places[kept], along[kept], FEW_VIEWS)
    return replace(found, cut=int(kept[found.cut])) if found else None


def _commands(of: Prospect, task: str, split: int | None = None, more: str = "") -> tuple[str, ...]:
    """The words to type; at ``split`` a drive that comes back is cut in two, of which the first is learnt."""
    log, options = _typed(str(of.path)), selection_words(of.selection)
    if of.troubles and task != "check":
        options += [f"--sensors {shlex.quote(','.join(of.well))}"]
    stem = of.path.name.partition(".")[0] or "robot"
    learnt, beliefs = _typed(f"{stem}.refseq"), "beliefs.parquet"
    if task == "check":
        return (" ".join(["refseq log check", log, *options, more]),)
    if task in ("alone", "in a map"):
        stage = ["--stage uniform"] if task == "alone" else []
        return (" ".join(["refseq localise MAP", log, *options, *stage, "-o", beliefs]),)
    if task == "stretch":
        if of.selection.views:
            return ()  # nobody counts views within views
        options = [more, *options]
    elif task == "learn" and more:
        options = [*options, more]
    if task in ("learn", "stretch"):
        return (" ".join(["refseq learn", log, *options, f"--profile {PROFILE} -o", learnt]),)
    if split is None or of.plan is None:
        return (" ".join(["refseq localise", learnt, "SECOND", *options, "-o", beliefs]),)
    part = _typed(f"{stem}-first.refseq")
    first, rest = f"--views 0:{split}", f"--views {split}:{len(of.plan)}"
    learn = " ".join(["refseq learn", log, first, *options, f"--profile {PROFILE} -o", part])
    return learn, " ".join(["refseq localise", part, log, rest, *options, "-o", beliefs])


def _typed(name: str) -> str:
    """A file's name as a shell takes it; by the numbers of its bytes where a terminal would not show some."""
    if name.isprintable():
        return shlex.quote(name)
    plain = set(string.ascii_letters + string.digits + "/._- ")
    shown = (chr(byte) if chr(byte) in plain else f"\\x{byte:02x}" for byte in os.fsencode(name))
    return f"$'{''.join(shown)}'"


def selection_words(selection: DriveSelection) -> list[str]:
    """The options of a selection, as they are typed."""
    words = [f"--views {shlex.quote(selection.views)}"] if selection.views else []
    words += [f"--thin {selection.thin:g}"] if selection.thin else []
    words += [f"--tolerance {selection.tolerance:g}"] if selection.tolerance is not None else []
    given = {
        "late": selection.late,
        "odometry": selection.odometry,
        "truth": selection.truth,
        "topics": selection.topics,
    }
    return words + [f"--{name} {shlex.quote(value)}" for name, value in given.items() if value is not None]
