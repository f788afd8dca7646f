from pathlib import Path

import numpy as np
import pytest

from refseq.errors import MapError
from refseq.inference.matching.information import feature_information, neighbour_noise
from refseq.map.compact import compact
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.sequence import ReferenceSequence
from refseq.view import View
from tests.support import corridor_drive

WORDS = 60


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=8, size=96)


def words_of(sequence: ReferenceSequence) -> dict[bytes, float]:
    """Information of each word, by its descriptor."""
    found, matrix = {}, sequence.matrix
    for extractor in sequence.extractors:
        if extractor.state():
            block = matrix.blocks[extractor.key]
            told = feature_information(matrix, block, neighbour_noise(matrix, block))
            words = [extractor.key.encode() + word.tobytes() for word in extractor.state()["words"]]
            found |= dict(zip(words, told.tolist(), strict=True))
    return found


def test_the_words_that_are_kept_tell_most(views: list[View]) -> None:
    whole, small = learn(views).sequence, learn(views, most_informative=WORDS).sequence
    told, kept = words_of(whole), set(words_of(small))
    assert len(kept) == WORDS < len(told)
    assert min(told[word] for word in kept) >= max(told[word] for word in told if word not in kept)


def test_places_show_what_is_left_and_all_bits_of_tables(views: list[View]) -> None:
    whole, small = learn(views).sequence, learn(views, most_informative=WORDS).sequence
    for extractor in small.extractors:
        block = small.matrix.blocks[extractor.key]
        assert len(block) == extractor.size
        if not extractor.state():
            assert len(block) == len(whole.matrix.blocks[extractor.key])
        for place, view in enumerate(views):
            ids = small.matrix.column(place)
            own = ids[(ids >= block.start) & (ids < block.stop)] - block.start
            # What was an alias of a forgotten word may be one of another: a view may show more than was learnt of it.
            assert set(own) <= set(extractor.observe(view).ids)


def test_more_words_than_there_are_leave_the_map_as_it_is(views: list[View]) -> None:
    assert learn(views, most_informative=10**6).to_bytes() == learn(views).to_bytes()


def test_no_word_at_all_is_refused(views: list[View]) -> None:
    with pytest.raises(MapError) as caught:
        learn(views, most_informative=0)
    assert str(caught.value) == "0 words are to be kept; valid is a whole number of at least 1"


def test_a_compact_map_forgets_words_and_can_be_loaded(views: list[View], tmp_path: Path) -> None:
    whole = learn(views)
    small = compact(whole, alike=1.0, within=2.0)
    assert len(small.map) == len(whole)
    assert len(words_of(small.map.sequence)) < len(words_of(whole.sequence))
    assert len(small.map.to_bytes()) < 0.9 * len(whole.to_bytes())
    small.map.save(tmp_path / "small.refseq")
    assert Map.load(tmp_path / "small.refseq").to_bytes() == small.map.named("small").to_bytes()
