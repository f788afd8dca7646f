"""The same for hours: memory that grows with every view, step or metre fills any machine in the end."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.robustness.attack import Attempt, attack
from tests.robustness.memory import growth

if TYPE_CHECKING:
    from refseq import Belief, View
    from refseq.map.map import Map
    from refseq.map.sequence import ReferenceSequence

VIEWS = 10_000
BOUND = 1.0
"""Memory may grow by so much [MB a 1000 views]."""
UNIT = "MB a 1000 views"
PLACES = 40
HOURS = 7200.0
"""Limit of one soak [s]: about ten minutes of a processor, on a busy machine."""
SIZE = 120
"""Height of the cameras' pictures [pixels]: small ones, so that 10 000 take minutes."""

soak = partial(attack, family="soak", tries=1, short=0, limit=HOURS)


@soak(promise="10 000 views leave no memory behind in a localiser of best")
def soak_best(seed: int, _folder: Path) -> Attempt:
    """Localise for long."""
    return _soaked(_localised(_learnt("best"), seed))


@soak(promise="10 000 views leave no memory behind in a localiser of the thesis")
def soak_thesis(seed: int, _folder: Path) -> Attempt:
    """Localise for long."""
    return _soaked(_localised(_learnt("thesis"), seed))


@soak(promise="10 000 views leave no memory behind in a localiser with an atlas")
def soak_atlas(seed: int, _folder: Path) -> Attempt:
    """Localise for long in the map of two drives that were merged."""
    from refseq.atlas.merge import merge_maps
    from tests.refseq.rooms import named_maps

    parts = [_learnt("best", views) for views in (_drive()[:25], _drive()[15:])]
    atlas = merge_maps(named_maps(("first", "second"), parts)).map
    return _soaked(_localised(atlas, seed))


@soak(promise="10 000 views to a live viewer leave no memory behind in their sender")
def soak_viewer(seed: int, _folder: Path) -> Attempt:
    """Localise for long and show it in a page on this machine."""
    from refseq.access.listener import free_port
    from refseq.viewer.belief_log import LocaliserLayer
    from refseq.viewer.live_logger import LiveLogger
    from refseq.viewer.places import Places
    from refseq.viewer.sinks import served

    drive = _drive()
    map_ = _learnt("thesis", drive)
    with served(free_port(), "soak", memory="200MB") as (stream, _page):
        logger = LiveLogger(stream, [LocaliserLayer("own", ("chain",), Places.of(map_, drive))])
        return _soaked(_localised(map_, seed, lambda view, belief: logger.update(view, {"own": {"chain": belief}})))


@soak(promise="10 000 steps with resets leave no memory behind in an environment")
def soak_environment(seed: int, _folder: Path) -> Attempt:
    """Act at random, and begin anew whenever an episode is over."""
    return _soaked(itertools.islice(acted(seed), VIEWS), "MB a 1000 steps")


def _soaked(steps: Iterable[object], unit: str = UNIT) -> Attempt:
    found = growth(steps, VIEWS)
    return Attempt(f"memory grows by {found:.2f} {unit}" if found > BOUND else None, {unit: found})


@cache
def _drive() -> "list[View]":
    from tests.support import corridor_drive

    views = corridor_drive(np.random.default_rng(0), PLACES, size=SIZE)
    return [replace(view, scan=_coarse(view)) for view in views]


def _coarse(view: "View") -> object:
    """Every fourth beam: finding walls takes its time."""
    assert view.scan is not None
    return replace(view.scan, ranges=view.scan.ranges[::4], step=4 * view.scan.step)


def _learnt(profile: str, views: "Sequence[View] | None" = None) -> "ReferenceSequence":
    from refseq.map.learning import learn

    return learn(views or _drive(), profile=profile)


def _localised(
    map_: "Map | ReferenceSequence", seed: int, told: "Callable[[View, Belief], None] | None" = None
) -> "Iterator[Belief]":
    """Beliefs about views to and fro along the drive."""
    from refseq.map.localiser import Localiser

    localiser = Localiser(map_)
    for view in to_and_fro(np.random.default_rng(seed), VIEWS):
        belief = localiser.update(view)
        if told:
            told(view, belief)
        yield belief


def to_and_fro(rng: np.random.Generator, count: int) -> "Iterator[View]":
    """The drive forth and back again, with new noise on pictures, scans and odometry each time."""
    drive = _drive()
    there_and_back = [*range(len(drive)), *range(len(drive) - 2, 0, -1)]
    for number, place in zip(range(count), itertools.cycle(there_and_back), strict=False):
        view = drive[place]
        assert view.scan is not None
        forth = number % len(there_and_back) < len(drive)
        images = {
            name: np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)
            for name, image in view.images.items()
        }
        ranges = (view.scan.ranges + rng.normal(0, 0.01, view.scan.ranges.shape)).astype(np.float32)
        moved = (0.85 if forth else -0.85) + rng.normal(0, 0.02) if number else 0.0
        scan = replace(view.scan, ranges=ranges)
        yield replace(view, time=2.0 * number, images=images, scan=scan, distance=moved, turn=rng.normal(0, 0.01))


def acted(seed: int) -> Iterator[object]:
    """Steps of an environment without end."""
    import gymnasium as gym

    import refseq_bench.sim.envs  # noqa: F401 - registers the environments

    env = gym.make("refseq/FollowCorridorTwist-v0", world="corridor:3")
    env.action_space.seed(seed)
    env.reset(seed=seed)
    while True:
        _seen, _reward, ended, cut, _told = env.step(env.action_space.sample())
        if ended or cut:
            env.reset()
        yield None
