"""Run one mission in a world as a person asks for it, and write what is left of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from refseq.belief import Belief
from refseq.errors import MapError
from refseq.files import replace_bytes, replace_text, replacing_at
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.missions import Entry, Executor, Plan, TrueWay
from refseq.missions.limits import TIMEOUT
from refseq.planar import Pose, wrap
from refseq.view import LASER, View
from refseq.viewer.mission.record import HeardLocaliser, MissionRecord, Recorder
from refseq_bench.robots.individual import CALIBRATED
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.scenarios.drives.route import plan_of
from refseq_bench.scenarios.drives.viewer_recording import RECORD
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.missions.bystander import Bystander, MissionFrame
from refseq_bench.scenarios.missions.leader import Leader
from refseq_bench.scenarios.missions.map_world import check_world
from refseq_bench.scenarios.missions.runs import NOWHERE, MissionResult, run_plan
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.drives.view_spacing import MISSION_EVERY
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.worlds.drawing.outline import outline_of


@dataclass(frozen=True, slots=True)
class MissionTrip:
    """A mission's ``drive``: world, light, robot, seed; the robot is set down ``at`` [m] along the way.

    With ``odometry`` it takes no view. A bystander looks every ``filmstrip`` [s]; None: there is none.
    """

    drive: Drive
    at: float = 0.0
    odometry: bool = False
    filmstrip: float | None = None

    @classmethod
    def from_map(
        cls,
        map_: Map,
        *,
        world: str | None = None,
        light: str | None = None,
        change: str = "none",
        robot: str | None = None,
        robot_spread: str = CALIBRATED,
        at: float = 0.0,
        seed: int = 1,
        renderer: str | None = None,
        odometry: bool = False,
        filmstrip: float | None = None,
        every: float = MISSION_EVERY,
        takes_pictures: bool = False,
    ) -> "MissionTrip":
        """Complete what is None from the first map's own drive.

        One that ``takes_pictures``, for a scene or a photograph, needs cameras. Raises ``ScenarioError``.
        """
        told = map_.sequences[0].metadata
        if world is None:
            check_world(map_)
        for name, given in (("light", light), ("robot", robot)):
            if given is None and name not in told:
                raise ScenarioError(f"the map does not tell its {name}; valid is to say it: --{name}")
        looks = (map_.sensors != {LASER} and not odometry) or filmstrip is not None or takes_pictures
        kind = renderer or (_renderer_of(told) if looks else RendererKind.NONE.value)
        if kind not in list(RendererKind):
            raise ScenarioError(f"renderer {kind!r} is unknown; valid are {', '.join(RendererKind)}")
        drive = Drive(
            world=world or told["world"],
            light=light or told["light"],
            change=change,
            robot=robot or told["robot"],
            robot_spread=robot_spread,
            seed=seed,
            renderer=RendererKind(kind),
            trigger=Trigger(distance=every),
            patience=TIMEOUT,
        )
        if drive.renderer is RendererKind.NONE and (takes_pictures or filmstrip is not None):
            what = "a filmstrip" if filmstrip is not None else "a photograph, or a scene,"
            valid = ", ".join(kind for kind in RendererKind if kind is not RendererKind.NONE)
            raise ScenarioError(f"{what} needs a renderer; valid are --renderer {valid}")
        return cls(drive, at, odometry, filmstrip)


def _renderer_of(told: Mapping[str, str]) -> str:
    """The renderer of a map's own drive, the usual one where that had none."""
    kind = told.get("renderer", DEFAULT_RENDERER)
    return DEFAULT_RENDERER if kind == RendererKind.NONE else kind


@dataclass(frozen=True)
class TripResult:
    """A trip that was made, the frames of who stood by, and what there is to see of it."""

    done: MissionResult
    frames: tuple[MissionFrame, ...]
    record: MissionRecord


class TripWatcher(Protocol):
    """Whoever watches a mission while it runs."""

    def saw(self, view: View, belief: Belief) -> None:
        """A view was taken, and this is believed of it."""

    def look(self, executor: Executor, bench: Bench) -> None:
        """A control period has gone by, or the robot has come to rest; the mission may be paused or aborted."""


def run_trip(
    trip: MissionTrip,
    map_: Map,
    plan: Plan,
    tell: Callable[[Entry], None] | None = None,
    watcher: TripWatcher | None = None,
) -> TripResult:
    """Run a mission; ``tell`` hears each line of its log as it comes. Raises the rooms' own errors."""
    told, bystander = 0, None if trip.filmstrip is None else Bystander(trip.filmstrip)
    recorder = Recorder()

    def each(executor: Executor, bench: Bench) -> None:
        nonlocal told
        recorder.note(executor, bench.pose)
        if bystander is not None:
            bystander(executor, bench)
        if watcher is not None:
            watcher.look(executor, bench)
        if tell is not None:
            for entry in executor.log[told:]:
                tell(entry)
        told = len(executor.log)

    poses = poses_of(map_, plan)
    ground = TrueWay(plan.path, np.array([(pose.x, pose.y) for pose in poses]))
    localiser = None if trip.odometry else recorder.heard(Localiser(map_))
    if watcher is not None and localiser is not None:
        localiser = HeardLocaliser(localiser, watcher.saw)
    leader = Leader(ground, localiser)
    with bench_on_way(trip, poses, plan) as bench:
        done = run_plan(bench, leader, plan, known_goal, sensors=None, drive=trip.drive, each=each)
    record = recorder.record(plan, ground.places, outline_of(plan_of(trip.drive)))
    return TripResult(done, () if bystander is None else tuple(bystander.frames), record)


def known_goal(plan: Plan) -> tuple[float, float] | None:
    """Goal of a plan as it became: nowhere, where it leaves the way or a landmark was not found; None: on the way."""
    return None if plan.sought is None and plan.orders[-1].travels else NOWHERE


def bench_on_way(trip: MissionTrip, poses: Sequence[Pose], plan: Plan) -> Bench:
    """A bench with the robot set down on a plan's way, looking as it looked when that was learnt.

    Between two places it is on the straight line from one to the other.
    """
    way = plan.path
    if not 0 <= trip.at < way.length:
        raise ScenarioError(f"start {trip.at:g} m is not on the way; valid is 0 to {way.length:.1f} m, less than that")
    at = int(np.searchsorted(way.along, trip.at, side="right")) - 1
    share = float((trip.at - way.along[at]) / (way.along[at + 1] - way.along[at]))
    start = _pose_between(poses[at], poses[at + 1], share)
    ahead = next((pose for pose in poses[at + 1 :] if np.hypot(pose.x - start.x, pose.y - start.y) > 0.1), None)
    if ahead is None:
        raise ScenarioError(f"start {trip.at:g} m the way is at its end; valid is before that")
    waypoints = ((start.x, start.y), (ahead.x, ahead.y))
    bench = open_bench(replace(trip.drive, waypoints=waypoints), watched=trip.filmstrip is not None)
    bench.place(start)
    return bench


def _pose_between(before: Pose, after: Pose, share: float) -> Pose:
    """A pose at a ``share`` of the way from one to the other."""
    turn = wrap(after.heading - before.heading)
    x, y = (one + share * (other - one) for one, other in ((before.x, after.x), (before.y, after.y)))
    return Pose(x, y, before.heading + share * turn)


def poses_of(map_: Map, plan: Plan) -> list[Pose]:
    """True poses of a way's places. Raises ``MapError`` where they are not known."""
    known = map_.poses
    poses = [pose for pose in (known[place] for place in plan.path.places) if pose is not None]
    if len(poses) < len(plan.path.places):
        raise MapError("the map does not know the true poses of its places; valid is one that was learnt in a world")
    return poses


def write_trip(folder: Path, trip: MissionTrip, made: TripResult) -> None:
    """Leave the log, the plan with the true path, the record, the photographs and the filmstrip in a folder."""
    # The viewer and the plots take a second to import, which a mission that leaves nothing does not wait for.
    from refseq.viewer.mission.tab import MissionTab
    from refseq.viewer.recording import write_recording
    from refseq.viewer.timelines import TIME
    from refseq_bench.scenarios.report.plots.mission import mission_plan
    from refseq_bench.scenarios.scoring.missions import score_mission

    run = made.done.run
    replace_text(folder / "log.txt", "".join(f"{entry}\n" for entry in run.log))
    name = f"mission: {trip.drive.robot} in {trip.drive.world} at {trip.drive.light}, seed {trip.drive.seed}"
    write_recording(folder / RECORD, [MissionTab(made.record)], name=name, timeline=TIME)
    score = score_mission(run, WIDE.distance, NARROW.distance)
    drawing = mission_plan(run, score, WIDE.distance, outline_of(plan_of(trip.drive)))
    replace_text(folder / "plan.svg", drawing.standalone)
    for name, images in made.done.photographs.items():
        for camera, image in images.items():
            replace_bytes(folder / f"{name}-{camera}.png", cv2.imencode(".png", image)[1].tobytes())
    if made.frames:
        from refseq_bench.scenarios.missions.filmstrip import filmstrip_of

        drive = trip.drive
        with replacing_at(folder / "filmstrip.png") as temporary:
            filmstrip_of(made.frames, f"{drive.robot} in {drive.world} at {drive.light}").savefig(temporary)
