"""What a step of the chain costs: against a dense and a banded Viterbi, and as the path grows.

Times are of the processor, so that a busy machine counts less. Paths are uneven, and every view comes after a distance
of its own, so that transitions are built anew for each.
"""

import itertools
import math
import time
import tracemalloc
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.forward import ForwardFilter
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.trajectory_entropy import trajectory_entropy
from refseq.inference.chain.viterbi import SlidingViterbi, viterbi
from tests.refseq.chains import dense_oracle, log_likelihoods

pytestmark = pytest.mark.benchmark
SPACINGS = {"views": 0.85, "fine grid": 0.2}  # [m]


def uneven_chain(K: int, spacing: float) -> Chain:
    rng = np.random.default_rng(K)
    return Chain(np.cumsum(spacing * rng.uniform(0.8, 1.2, K)), MotionSettings(), ChainSettings())


def views(K: int, count: int, distance: float = 0.85) -> list[Observation]:
    rng = np.random.default_rng(count)
    return [
        Observation(distance * float(rng.uniform(0.9, 1.1)), rng.normal(scale=4, size=K), 0.0) for _ in range(count)
    ]


def milliseconds(run: Callable[[], object], repeats: int = 7) -> float:
    """The least processor time of several."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def per_step(decode: Callable[[int], object], few: int = 5, many: int = 45) -> float:
    """Milliseconds a step, from drives of two lengths, so that what is done once for a drive does not count."""
    return (milliseconds(lambda: decode(many)) - milliseconds(lambda: decode(few))) / (many - few)


class Band(NamedTuple):
    """The diagonals k − j that the motion window may reach, and log P(k | j, d) on them, (diagonals, K) by k."""

    diagonals: range
    log_height: np.ndarray


class BandedViterbi:
    """The same chain by a band of the motion window in plain NumPy, one diagonal at a time.

    It keeps where each state came from, as Fig. 3.9 has it. Of the structure it takes the running maximum over the
    Lost_Places, since plain matrices would be dense there.
    """

    def __init__(self, chain: Chain) -> None:
        self.chain, s, along = chain, chain.settings, chain.along
        self.log_go, self.log_leave = math.log(1 - s.lost), math.log(s.lost)
        self.log_stay, self.log_found = math.log(s.stay_lost), math.log(1 - s.stay_lost)
        self.decay = along / s.relocalisation_range
        self.log_find = self.log_found - np.logaddexp.accumulate(-self.decay[::-1])[::-1]
        self.gap = float(np.diff(along).min())
        self.window: deque[tuple[Band, Observation]] = deque(maxlen=s.window)

    def band(self, distance: float) -> Band:
        along, motion = self.chain.along, self.chain.motion
        wide = motion.slack + motion.drift * abs(distance)
        reach = wide + abs(distance)
        diagonals = range(math.ceil((distance - reach) / self.gap), math.floor((distance + reach) / self.gap) + 1)
        height = np.zeros((len(diagonals), len(along)))
        mass = np.zeros(len(along))
        for row, offset in zip(height, diagonals, strict=True):
            to, source = shifted(offset, len(along))
            off = np.abs(along[to] - along[source] - distance)
            row[to] = np.where(off <= wide, 1.0, np.where(off <= reach, motion.tail, 0.0))
            mass[source] += row[to]
        for row, offset in zip(height, diagonals, strict=True):
            to, source = shifted(offset, len(along))
            row[to] /= mass[source]
        with np.errstate(divide="ignore"):
            return Band(diagonals, np.log(height))

    def update(self, observation: Observation) -> tuple[int, ...]:
        self.window.append((self.band(observation.distance), observation))
        return self.decode(self.window)

    def decode(self, steps: Sequence[tuple[Band, Observation]]) -> tuple[int, ...]:
        places, lost = self.chain.start()
        sources = []
        for number, (band, observation) in enumerate(steps):
            if number:
                places, lost, places_from, lost_from = self.step(band, places, lost)
                sources.append(np.concatenate([places_from, lost_from]))
            places, lost = places + observation.places, lost + observation.lost
        path = [int(np.argmax(np.concatenate([places, lost])))]
        for source in reversed(sources):
            path.append(int(source[path[-1]]))
        return tuple(reversed(path))

    def step(self, band: Band, places: np.ndarray, lost: np.ndarray) -> tuple[np.ndarray, ...]:
        """Best scores of places and Lost_Places, and the states they come from."""
        K = len(places)
        states = np.arange(2 * K)
        leaving = lost + self.log_find
        leaving[0] = -np.inf
        running = np.maximum.accumulate(leaving)
        best = running - self.decay
        source = K + np.maximum.accumulate(np.where(leaving == running, states[:K], 0))
        anywhere = lost[0] + self.log_found - math.log(K)
        source[best < anywhere] = K
        np.maximum(best, anywhere, out=best)
        outgoing = places + self.log_go
        for log_row, offset in zip(band.log_height, band.diagonals, strict=True):
            to, before = shifted(offset, K)
            score = outgoing[before] + log_row[to]
            np.copyto(source[to], states[before], where=score > best[to])
            np.maximum(best[to], score, out=best[to])
        best_lost, lost_from = lost + self.log_stay, states[K:].copy()
        getting_lost = places + self.log_leave
        np.copyto(lost_from[1:], states[: K - 1], where=getting_lost[:-1] > best_lost[1:])
        np.maximum(best_lost[1:], getting_lost[:-1], out=best_lost[1:])
        if getting_lost[-1] > best_lost[-1]:
            best_lost[-1], lost_from[-1] = getting_lost[-1], K - 1
        return best, best_lost, source, lost_from


def shifted(offset: int, K: int) -> tuple[slice, slice]:
    """Targets and sources of the diagonal k − j = offset."""
    return slice(max(offset, 0), K + min(offset, 0)), slice(max(-offset, 0), K + min(-offset, 0))


def steady(observations: Sequence[Observation], distance: float) -> list[Observation]:
    """The same views at one pace, so that one matrix serves them all."""
    return [replace(observation, distance=distance) for observation in observations]


def test_a_step_with_its_transitions_at_hand() -> None:
    """Structure, band and dense matrix, all built beforehand; all three find the same path."""
    print("\n1000 places, 2000 states, transitions at hand       [ms a step]")
    print("places     diagonals  structure    band  hmmlearn  band / structure  hmmlearn / structure")
    for name, spacing in SPACINGS.items():
        chain = uneven_chain(1000, spacing)
        drive, banded = steady(views(chain.K, 45), 0.85), BandedViterbi(chain)
        band = banded.band(0.85)
        steps = [(band, observation) for observation in drive]
        oracle = dense_oracle(chain, 0.85)
        samples = np.array([log_likelihoods(observation, chain.K) for observation in drive])
        ours = per_step(lambda t, chain=chain, drive=drive: viterbi(drive[:t], chain))
        bands = per_step(lambda t, banded=banded, steps=steps: banded.decode(steps[:t]))
        dense = per_step(lambda t, oracle=oracle, samples=samples: oracle.decode(samples[:t]), 2, 12)
        print(
            f"{name:9s} {len(band.diagonals):10d} {ours:10.3f} {bands:7.3f} {dense:9.2f}"
            f" {bands / ours:17.1f} {dense / ours:21.0f}"
        )
        assert viterbi(drive, chain).path == banded.decode(steps) == tuple(oracle.decode(samples)[1])
        assert dense > 50 * ours
        assert bands > 0.8 * ours


def test_a_view_of_a_window_with_a_distance_of_its_own() -> None:
    """T = 5, and transitions built for each view; hmmlearn would have to be given a new matrix."""
    print("\n1000 places, T = 5, transitions built for each view  [ms a view]")
    print("places     distance [m]  structure    band  band / structure")
    for (name, spacing), distance in itertools.product(SPACINGS.items(), (0.85, 5.0)):
        chain = uneven_chain(1000, spacing)
        drive, banded, window = views(chain.K, 30, distance), BandedViterbi(chain), SlidingViterbi(chain)
        assert [window.update(view).path for view in drive] == [banded.update(view) for view in drive]
        ours = milliseconds(lambda window=window, drive=drive: [window.update(view) for view in drive]) / len(drive)
        bands = milliseconds(lambda banded=banded, drive=drive: [banded.update(view) for view in drive]) / len(drive)
        print(f"{name:9s} {distance:13.2f} {ours:10.3f} {bands:7.3f} {bands / ours:17.1f}")
        assert bands > 0.8 * ours


@pytest.mark.parametrize("name", SPACINGS)
def test_growth_with_the_path(name: str) -> None:
    """A view at the window T = 5, a step of the forward filter, and the trajectory entropy of a view."""
    sizes = (1_000, 10_000, 100_000)
    print(f"\n{name}: {SPACINGS[name]} m apart          [ms a view]")
    print("  places  Viterbi T=5  forward  entropy   memory of window [MB]")
    rows = []
    for K in sizes:
        chain = uneven_chain(K, SPACINGS[name])
        drive = itertools.cycle(views(K, 9))
        window, tracker = SlidingViterbi(chain), ForwardFilter(chain)
        tracemalloc.start()
        for _ in range(5):
            window.update(next(drive))
        memory = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        tracker.update(next(drive))
        some = [next(drive) for _ in range(3)]
        rows.append(
            (
                milliseconds(lambda window=window, drive=drive: window.update(next(drive)), 15),
                milliseconds(lambda tracker=tracker, drive=drive: tracker.update(next(drive)), 15),
                milliseconds(lambda some=some, chain=chain: trajectory_entropy(some, chain), 5) / 3,
            )
        )
        print(f"{K:8d} " + " ".join(f"{value:9.2f}" for value in rows[-1]) + f" {memory:14.1f}")
    exponents = np.log(np.divide(rows[-1], rows[0])) / math.log(sizes[-1] / sizes[0])
    print("exponent " + " ".join(f"{value:9.2f}" for value in exponents))
    # A matrix of places by places would be 2.
    assert exponents.max() < 1.3
