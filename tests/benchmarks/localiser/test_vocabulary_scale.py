"""What it costs to find one image's words in a small and in a large vocabulary, exactly and by the index.

Words are SIFT descriptors of drawn pictures; an image to be matched is one of those pictures turned, enlarged, moved,
darker and with noise, so that about half of its descriptors have a word.
"""

import time
import tracemalloc
from collections.abc import Callable
from typing import NamedTuple

import cv2
import faiss
import numpy as np
import pytest

from refseq.features.sift import SiftSettings, SiftWords
from refseq.features.vocabulary import Vocabulary

pytestmark = pytest.mark.benchmark
SIZES = (8_000, 20_000, 100_000)
CAP = 200
QUERIES = 15
SHAPE = (640, 480)
ALWAYS, NEVER = 0, np.inf
"""When the index is used, as values of ``exact_up_to``."""


def picture(number: int) -> np.ndarray:
    """Blobs of three sizes, (480, 640), from 0 to 1."""
    rng = np.random.default_rng(number)
    sizes = rng.choice([6, 8, 12, 16, 20, 28, 40, 60, 90], 3, replace=False)
    layers = [cv2.resize(rng.random((480 // s, 640 // s)), SHAPE, interpolation=cv2.INTER_CUBIC) for s in sizes]
    return np.clip(np.mean(layers, axis=0), 0, 1)


def seen_again(number: int) -> np.ndarray:
    """The picture from nearby, in less light."""
    rng = np.random.default_rng([number, 1])
    change = cv2.getRotationMatrix2D((320, 240), rng.normal(0, 2), 1 + rng.normal(0, 0.05))
    change[:, 2] += rng.normal(0, 5, 2)
    moved = cv2.warpAffine(picture(number), change, SHAPE, borderMode=cv2.BORDER_REFLECT)
    return np.clip(0.7 * moved + rng.normal(0, 0.008, moved.shape), 0, 1)


def described(image: np.ndarray, cap: int) -> np.ndarray:
    return SiftWords("camera", SiftSettings(cap=cap)).keys((255 * image).astype(np.uint8)).descriptors


class Growth(NamedTuple):
    """Words in the order of their pictures, and how many there were after each picture."""

    words: np.ndarray
    after: list[int]


@pytest.fixture(scope="module")
def growth() -> Growth:
    vocabulary = Vocabulary(SiftSettings().alias_distance, np.zeros((0, 128), np.uint8))
    after: list[int] = []
    while len(vocabulary) < max(SIZES):
        vocabulary.learn(described(picture(len(after)), 10**6))
        after.append(len(vocabulary))
    return Growth(vocabulary.words, after)


def milliseconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - start)


def peak_megabytes(work: Callable[[], object]) -> float:
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()


def test_matching_an_image_exactly_and_by_the_index(growth: Growth) -> None:
    limit = SiftSettings().alias_distance
    print(f"\n{CAP} descriptors an image, {QUERIES} images, medians")
    print("  words  exact [ms]  index [ms]  found by index  learning [ms]  making index [ms]  index [MiB]  peak [MiB]")
    cost = {}
    for size in SIZES:
        words = growth.words[:size]
        shown = np.linspace(0, np.searchsorted(growth.after, size) - 1, QUERIES).astype(int)
        images = [d for d in (described(seen_again(n), CAP) for n in shown) if len(d) == CAP]
        exact, fast = (Vocabulary(limit, words, exact_up_to) for exact_up_to in (NEVER, ALWAYS))
        making = milliseconds(lambda fast=fast, images=images: fast.match(images[0]))
        rows = []
        for image in images:
            expected, found = exact.match(image), fast.match(image)
            rows.append(
                (
                    milliseconds(lambda exact=exact, image=image: exact.match(image)),
                    milliseconds(lambda fast=fast, image=image: fast.match(image)),
                    len(expected),
                    len(np.intersect1d(found, expected)),
                    milliseconds(lambda image=image, words=words: Vocabulary(limit, words).learn(image)),
                )
            )
        slow, quick, _, _, learning = np.median(rows, axis=0)
        _, _, total, hit, _ = np.sum(rows, axis=0)
        assert total > 0.25 * CAP * len(images), "or there is little to be found"
        held = faiss.serialize_index(fast._indexed()._cells).nbytes / 2**20
        peak = peak_megabytes(lambda exact=exact, images=images: exact.match(images[0]))
        print(
            f"{size:7d}  {slow:10.2f}  {quick:10.2f}  {hit / total:14.4f}  {learning:13.2f}  {making:17.0f}"
            f"  {held:11.1f}  {peak:10.1f}"
        )
        assert hit / total > 0.98
        assert held < 1.5 * words.nbytes / 2**20
        assert peak < 8, "exact matching takes memory for a block of words, however many there are"
        cost[size] = slow, quick
    small, large = cost[min(SIZES)], cost[max(SIZES)]
    assert large[0] < 2 * small[0] * max(SIZES) / min(SIZES), "exact matching grows with the words"
    assert 2 * large[1] < large[0], "in a large vocabulary the index must be worth its misses"
