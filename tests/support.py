"""Drives and answers made by rule, for tests that need a whole run without a simulator."""

import math
from collections.abc import Iterator, Mapping, Sequence

import cv2
import numpy as np

from refseq.belief import Belief, Stage, Timings
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq_bench.scenarios.scoring.comparison import Comparison

CAMERAS = ("forward", "lateral")
CORRIDOR = (np.array([[0.0, -1.2], [100.0, -1.2]]), np.array([[0.0, 1.2], [100.0, 1.2]]))


def corridor_drive(
    rng: np.random.Generator, count: int = 118, spacing: float = 0.85, brightness: float = 1.0, size: int = 480
) -> list[View]:
    """A drive along the x axis between walls at y = ±1.2 m; images are textured by place, scans are exact."""
    y = 0.25 * np.sin(np.arange(count) / 9 + rng.uniform(0, 6))
    return [
        View(
            time=2.0 * k,
            images={name: texture(k * spacing, size, brightness, i) for i, name in enumerate(CAMERAS)},
            scan=corridor_scan(1.0 + k * spacing, y[k]),
            distance=spacing if k else 0.0,
            truth=Pose(1.0 + k * spacing, float(y[k]), 0.05 * math.sin(k / 5)),
        )
        for k in range(count)
    ]


def texture(along: float, size: int, brightness: float, camera: int) -> np.ndarray:
    """A smooth random picture that changes from place to place, (size, 4/3 size) uint8."""
    rng = np.random.default_rng([int(along), camera])
    picture = cv2.resize(rng.random((12, 16)), (size * 4 // 3, size), interpolation=cv2.INTER_CUBIC)
    return np.clip(picture * 200 * brightness, 0, 255).astype(np.uint8)


class CountedImages(Mapping[str, np.ndarray]):
    """A view's images, which note each that is asked for, as a recording decodes it then."""

    def __init__(self, images: Mapping[str, np.ndarray], asked: list[str]) -> None:
        self._images, self._asked = images, asked

    def __getitem__(self, camera: str) -> np.ndarray:
        self._asked.append(camera)
        return self._images[camera]

    def __iter__(self) -> Iterator[str]:
        return iter(self._images)

    def __len__(self) -> int:
        return len(self._images)


def corridor_scan(x: float, y: float, length: float = 102.0) -> Scan:
    """361 beams from (x, y) looking along the corridor, each to the first wall it meets."""
    bearings = np.linspace(-np.pi / 2, np.pi / 2, 361)
    with np.errstate(divide="ignore"):
        side = np.where(np.sin(bearings) > 0, 1.2 - y, 1.2 + y) / np.abs(np.sin(bearings))
        end = (length - x) / np.maximum(np.cos(bearings), 1e-9)
    return Scan(np.minimum(side, end).astype(np.float32))


def peaked(places: int, peak: float, width: float, lost: float = 0.0, floor: float = 1e-4) -> Belief:
    """A belief that is a bell around ``peak`` on a low floor."""
    weights = np.exp(-(((np.arange(places) - peak) / width) ** 2) / 2) + floor
    weights /= weights.sum()
    entropy = float(-np.sum(weights * np.log(weights)))
    best = int(np.argmax(weights))
    return Belief(weights, lost, best, (best,), entropy, Timings(0.03, 0.002, 0.004, 0.0005))


def certain(places: int, place: int, lost: float = 0.0) -> Belief:
    """A belief that knows one place only."""
    return Belief(np.eye(places)[place], lost, place, (place,), 0.0)


def beliefs_with_errors(rng: np.random.Generator, count: int, places: int, wrong: float, width: float) -> list[Belief]:
    """One answer a view, off by many places for about a share ``wrong`` of them, and lost for a tenth of those."""
    answers = []
    for t in range(count):
        astray = rng.random() < wrong
        peak = rng.integers(places) if astray else t * places / count + rng.normal(0, 0.5)
        lost = rng.uniform(0.55, 0.95) if astray and rng.random() < 0.3 else rng.uniform(0, 0.2)
        answers.append(peaked(places, float(np.clip(peak, 0, places - 1)), width, float(lost)))
    return answers


def corridor_comparison(seed: int = 0, count: int = 118, name: str = "16:00 → 18:00", size: int = 480) -> Comparison:
    """Two drives along the same corridor with answers that grow better from stage to stage."""
    rng = np.random.default_rng(seed)
    shares: Sequence[tuple[Stage, float, float]] = (
        (Stage.UNIFORM, 0.3, 2.5),
        (Stage.PRIOR, 0.15, 1.5),
        (Stage.CHAIN, 0.04, 0.7),
    )
    reference = corridor_drive(rng, count, size=size)
    query = corridor_drive(rng, count, brightness=0.6, size=size)
    common = {"world": "hallway", "robot": "robuter", "versions": {"refseq-bench": "0.1.0", "mujoco": "4.0.0"}}
    return Comparison(
        name,
        reference,
        {**common, "light": "16:00", "seed": seed},
        query,
        {**common, "light": "18:00", "seed": seed + 1000},
        {stage: beliefs_with_errors(rng, count, count, wrong, width) for stage, wrong, width in shares},
    )
