"""Gymnasium environment of a robot in a world: a task, with behaviours or twists for actions."""

import inspect
import math
from collections.abc import Generator, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.map.map import Map
from refseq.missions.behaviour_codes import kind_of
from refseq.missions.plan import Plan
from refseq_bench import robots
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.drives.behaviour_runner import description_of
from refseq_bench.sim.drives.chase_camera import ChaseCamera
from refseq_bench.sim.envs.episodes.actions import Acting, ByBehaviour, ByTwist
from refseq_bench.sim.envs.episodes.episode import BenchEpisode, EpisodeSetting, ground_of
from refseq_bench.sim.envs.episodes.localising import familiar
from refseq_bench.sim.envs.episodes.observations import IMAGE, SUMMARY, Arrays, Known, Sensing
from refseq_bench.sim.envs.episodes.pixels import square_camera
from refseq_bench.sim.envs.tasks.by_name import made_task
from refseq_bench.sim.envs.tasks.task import Judgement, Task
from refseq_bench.sim.envs.worlds.named import check_light, plan_named, world_named
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.physics import Due, alone
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.worlds.plans.schema import FloorPlan

if TYPE_CHECKING:
    from refseq_bench.sim.envs.display import EpisodeDisplay

ACTIONS = ("behaviours", "twist")
Stepped = tuple[Arrays, float, bool, bool, dict[str, Any]]
"""Observation, reward, whether the episode has ended, whether it was cut off, info."""
RENDERERS = tuple(kind.value for kind in RendererKind if kind is not RendererKind.NONE)
HUMAN = "human"
"""The render mode that shows each step in a viewer."""
BEHIND, UP = 3.5, 2.2
"""The picture of an episode is taken from so far behind the robot and so far above the floor [m]; choices."""


class RobotEnv(gym.Env[Arrays, Any]):
    """A robot that is to do a ``task`` in a ``world``; ``import refseq_bench.sim.envs`` registers ids of all tasks.

    ``world`` is a name, or several, of which each episode draws one; ``route`` is what is followed, or was learnt:
    without it the task's own, or the first of a world that has none of that name.
    ``actions`` are ``behaviours`` (``Discrete``, see ``ByBehaviour``) or ``twist`` (``Box``, see ``ByTwist``). Images
    of ``cameras`` are part of the observation, as squares of so many ``pixels`` a side, or as they are: they need a
    ``renderer``, as the pictures of ``render_mode`` do, and nothing else does. Tasks with a map tell what their
    localiser believes in one of two forms, ``belief``: ``summary`` or ``places``. ``Sensing`` tells what is observed.

    The reward is what the task's episode makes of the truth (``AlongCorridor``, ``ThroughDoor``, ``ToPlace``,
    ``FoundAgain``): what was made good towards the goal, +5 where it is reached, -5 for a failure. Both end the episode
    (``terminated``). Failures are a collision, and whatever keeps the robot from going until somebody helps.

    ``info`` is the truth: ``pose`` (3,) x, y [m], heading [rad]; ``distance_to_goal`` in the task's measure;
    ``collision``, ``success``, ``failure``; the ``action``, whether it is ``running``, ``finished`` or ``failed``
    (``outcome``) and ``why``; ``time`` [s], ``world``; with a map the ``place_error`` [m] of the most probable place.

    The same seed and actions give the same episode, bit for bit. Raises ``SimError`` for what is unknown or unfit.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 1}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        task: str | type[Task],
        world: str | Path | Sequence[str | Path],
        *,
        route: str | None = None,
        actions: str = "behaviours",
        robot: str = "robuter",
        light: str = "16:00",
        cameras: Sequence[str] = (),
        pixels: int | None = None,
        belief: str = SUMMARY,
        renderer: str = DEFAULT_RENDERER,
        render_mode: str | None = None,
        **asked: Any,
    ) -> None:
        _check("actions", actions, ACTIONS)
        _check("robot", robot, robots.names())
        _check("renderer", renderer, RENDERERS)
        if render_mode is not None:
            _check("render mode", render_mode, self.metadata["render_modes"])
        check_light(light)
        self._task = made_task(task, asked, _keywords())
        self._robot, self._light = robots.load(robot), light
        self._worlds = _checked_worlds(world, self._task)
        self._routes = {name: _route_in(name, route, self._task) for name in self._worlds}
        if isinstance(cameras, str) or not isinstance(cameras, Sequence):
            example = [cameras] if isinstance(cameras, str) else list(self._robot.cameras)[:1]
            raise SimError(f"cameras {cameras!r:.60} is not valid; valid is a list of names, as {example}")
        if pixels is not None and not cameras:
            raise SimError(
                f"pixels {pixels!r} without cameras is not valid; valid are cameras whose pictures are observed"
            )
        for camera in cameras:
            _check(f"camera of robot {robot!r}", camera, self._robot.cameras)
        self._cameras, self._renderer, self.render_mode = tuple(cameras), RendererKind(renderer), render_mode
        drawing = self._renderer if cameras else RendererKind.NONE
        small = {} if pixels is None else dict.fromkeys(self._robot.cameras, square_camera(CameraModel(), pixels))
        self._settings = BenchSettings(renderer=drawing, cameras=self._cameras, camera_models=small)
        self._image = IMAGE if pixels is None else (pixels, pixels)
        self._acting = self._actions(actions)
        self.metadata = self.metadata | {"render_fps": round(1 / self._acting.period)}
        self._map = self._learnt() if self._task.mapped else None
        self._sensing = self._observations(belief)
        self.action_space, self.observation_space = self._acting.space, self._sensing.space
        self._run: BenchEpisode | None = None
        self._over = False
        self._display: EpisodeDisplay | None = None

    def _learnt(self) -> Map:
        """The map of the one world, which the task fits."""
        (world,) = self._worlds
        map_ = familiar(world, self._light, self._robot.name, self._routes[world])
        self._task.check(ground_of(plan_named(world), self._routes[world], self._robot.shape, map_))
        return map_

    def _actions(self, form: str) -> Acting:
        if form == "twist":
            return ByTwist(self._robot.limits)
        return ByBehaviour(self._task.behaviours, description_of(self._robot))

    def _observations(self, belief: str) -> Sensing:
        return Sensing(
            sonars=len(self._robot.sonars),
            max_range=self._settings.laser.mode.max_range,
            cameras=self._cameras,
            image=self._image,
            places=None if self._map is None else len(self._map),
            belief=belief,
            goal=self._task.goes_to_place,
            behaviours=len(self._task.behaviours) if self._task.asks else 0,
        )

    @property
    def behaviours(self) -> tuple[str, ...]:
        """The behaviours that actions choose from, as they are written, by their numbers."""
        return self._task.behaviours

    @property
    def plan(self) -> Plan | None:
        """The plan of the mission of this episode; None for tasks without one."""
        return self._running.episode.plan

    @property
    def belief(self) -> Belief | None:
        """The localiser's answer to its last view, the same object until the next one; None for tasks without a map."""
        following = self._running.following
        return None if following is None else following.belief

    @property
    def motion(self) -> tuple[float, float, float]:
        """Motion that the odometer counted in the last action: ahead, to the left, about itself [m, m, rad]."""
        return self._running.motion

    @property
    def chooses_behaviours(self) -> bool:
        """True if actions are behaviours."""
        return isinstance(self._acting, ByBehaviour)

    @property
    def places(self) -> NDArray[np.float64] | None:
        """The true poses of the map's places, (K, 3): x, y [m], heading [rad]; None for tasks without a map."""
        if self._map is None:
            return None
        return np.array([(pose.x, pose.y, pose.heading) for pose in self._map.poses if pose is not None])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Arrays, dict[str, Any]]:
        """Set the robot down for a new episode; ``options`` are none."""
        super().reset(seed=seed)
        if options:
            raise SimError(f"options {', '.join(map(repr, options))} are unknown: there are none")
        self._end()
        name = self._worlds[int(self.np_random.integers(len(self._worlds)))]
        world = world_named(name, self._light, pictured=bool(self._cameras) or self.render_mode is not None)
        setting = EpisodeSetting(world, self._robot.name, self._settings, self._routes[name], self._map)
        self._run, self._over = BenchEpisode(self._task, setting, self.np_random), False
        self._acting.reset()
        if self.render_mode == HUMAN:
            self._begin_display(world.plan, world.routes[self._routes[name]])
        return self._seen(Judgement(0.0, self._run.remaining))

    def step(self, action: Any) -> Stepped:
        """Let the robot do something for a while; truncation is up to the wrapper ``TimeLimit``."""
        return alone(self.stepping(action))

    def stepping(self, action: Any) -> Generator[Due, None, Stepped]:
        """Do as ``step`` does, but leave the steps of the physics to the caller, who takes each that is due.

        Nothing moves before the first is asked for; what is wrong with the action is told at once.
        """
        run = self._running
        if self._over:
            raise SimError("the episode is over: call reset first")
        self._acting.choose(action)
        return self._moving(run)

    def _moving(self, run: BenchEpisode) -> Generator[Due, None, Stepped]:
        judged = yield from run.acting(self._acting)
        self._over = judged.over
        observation, told = self._seen(judged)
        return observation, judged.reward, judged.over, False, told

    def _seen(self, judged: Judgement) -> tuple[Arrays, dict[str, Any]]:
        if self._display is not None:
            self._show(judged)
        return self._observed(), self._told(judged)

    @property
    def _running(self) -> BenchEpisode:
        if self._run is None:
            raise SimError("no episode has begun, or it was closed: call reset first")
        return self._run

    def _observed(self) -> Arrays:
        run = self._running
        belief = None
        if run.following is not None and self._map is not None:
            asked = [(one.at, self.number_of(one.behaviour)) for one in run.episode.asked]
            belief = run.following.belief, Known(self._map.sequence.along, run.episode.goal, asked, run.following.gone)
        images = run.bench.photograph() if self._cameras else None
        scan, state, going = run.bench.scan(), run.bench.state, self._acting.going
        return self._sensing.observed(scan, state, run.motion, belief=belief, images=images, going=going)

    def number_of(self, behaviour: str) -> int:
        """The number of the action that is a behaviour of a plan."""
        return [kind_of(one) for one in self.behaviours].index(kind_of(behaviour))

    def _told(self, judged: Judgement) -> dict[str, Any]:
        run, pose = self._running, self._running.bench.pose
        told = {
            "pose": np.array([pose.x, pose.y, pose.heading]),
            "distance_to_goal": judged.remaining,
            "collision": run.touches,
            "success": judged.success,
            "failure": judged.failure,
            "action": self._acting.doing,
            "outcome": run.outcome.value,
            "why": run.why,
            "time": run.bench.time,
            "world": run.bench.world.name,
        }
        if run.following is not None and (places := self.places) is not None:
            x, y, _ = places[run.following.belief.best]
            told["place_error"] = math.hypot(x - pose.x, y - pose.y)
        return told | dict(run.episode.told)

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the robot from behind and above, (480, 640, 3).

        None with the render mode 'human', whose viewer shows each step by itself, and without a render mode. Raises
        ``RendererError`` where the renderer's driver is missing.
        """
        if self.render_mode is None:
            modes = " or ".join(map(repr, self.metadata["render_modes"]))
            gym.logger.warn(f"render was called without a render mode; valid is render_mode={modes}")
        if self.render_mode is None or self.render_mode == HUMAN:
            return None
        return np.repeat(self._picture()[:, :, None], 3, axis=2)

    def _picture(self) -> NDArray[np.uint8]:
        bench = self._running.bench
        if bench.renderer.kind is RendererKind.NONE:
            bench.draw_by(self._renderer)
        return ChaseCamera(bench, bearing=math.pi, distance=BEHIND, eyes=UP).look()

    def _begin_display(self, plan: FloorPlan, route: NDArray[np.float64]) -> None:
        # Rerun takes a second to import.
        from refseq_bench.sim.envs.display import EpisodeDisplay

        if self._display is None:
            self._display = EpisodeDisplay(type(self._task).__name__ if self.spec is None else self.spec.id)
        self._display.begin(plan, route)

    def _show(self, judged: Judgement) -> None:
        from refseq_bench.sim.envs.display import DisplayedStep

        assert self._display is not None, "reset has opened it"
        bench, scan = self._running.bench, self._running.bench.scan()
        told = f"{self._acting.doing or 'begin'} {self._running.why}".strip()
        if judged.over:
            told += ": goal reached" if judged.success else f": {judged.failure}"
        points = scan.points[np.isfinite(scan.ranges)]
        step = DisplayedStep(bench.time, bench.pose, self._picture(), points, judged.remaining, judged.reward, told)
        self._display.show(step)

    def close(self) -> None:
        """Give the renderer's device back, and end what the render mode 'human' has opened."""
        self._end()
        if self._display is not None:
            self._display.close()
            self._display = None

    def _end(self) -> None:
        """End the episode, if there is one."""
        if self._run is not None:
            self._run.close()
            self._run = None


def _check(what: str, value: object, valid: Iterable[str]) -> None:
    if value not in (known := tuple(valid)):
        raise SimError(f"unknown {what} {value!r}: valid are {', '.join(known)}")


def _keywords() -> tuple[str, ...]:
    """Keywords of ``RobotEnv`` itself, as ``gymnasium.make`` takes them."""
    parameters = inspect.signature(RobotEnv.__init__).parameters.values()
    return ("world", *(one.name for one in parameters if one.kind is inspect.Parameter.KEYWORD_ONLY))


def _checked_worlds(world: str | Path | Sequence[str | Path], task: Task) -> tuple[str, ...]:
    """The names of the worlds; raises ``SimError`` where they are none, or too many for the task."""
    if not isinstance(world, str | Path | Sequence):
        raise SimError(f"world = {world!r:.60} is not valid: valid is a name, a floor plan's file, or several")
    names = tuple(map(str, (world,) if isinstance(world, str | Path) else world))
    if not names or (task.mapped and len(names) > 1):
        most = "one world, as there is one map" if task.mapped else "one or more"
        raise SimError(f"world {list(names)} is not valid for this task: valid is {most}")
    return names


def _route_in(world: str, asked: str | None, task: Task) -> str:
    """The route that is asked for, else the task's own or a world's first. Raises ``SimError`` for an unknown one."""
    routes = tuple(plan_named(world).routes)
    if asked is None:
        return task.route if task.route in routes else routes[0]
    if asked not in routes:
        raise SimError(f"unknown route {asked!r} in world {world!r}: valid are {', '.join(routes)}")
    return asked
