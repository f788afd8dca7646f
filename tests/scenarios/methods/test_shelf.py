import numpy as np
import pytest

from refseq.errors import MapError
from refseq.map.compact import compact
from refseq.map.learning import learn
from refseq.view import View
from refseq_bench.scenarios.methods.shelf import Learning
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def views() -> list[View]:
    """Large enough that the pictures show words."""
    return corridor_drive(np.random.default_rng(0), 5, size=96)


def test_nothing_asked_leaves_the_map_as_it_is(views: list[View]) -> None:
    whole = learn(views, profile="best")
    made_by = Learning()
    assert made_by.smaller(made_by.learnt("best", views)).to_bytes() == whole.to_bytes()


def test_features_are_those_asked_for(views: list[View]) -> None:
    made = Learning(features=("corners", "walls")).learnt("thesis", views)
    assert {extractor.key for extractor in made.sequence.extractors} == {"corners/laser", "walls/laser"}
    with pytest.raises(MapError, match="feature 'smell' is unknown"):
        Learning(features=("smell",)).learnt("thesis", views)


@pytest.mark.parametrize("share", [0.5, 0.1, 1e-9])
def test_a_share_of_the_words_is_kept(views: list[View], share: float) -> None:
    """As ``learn`` keeps as many; bits of fixed tables are no words."""
    whole = learn(views)
    words = sum(one.size for one in whole.sequence.extractors if one.state())
    fewer = learn(views, most_informative=max(1, round(share * words)))
    assert Learning(words=share).smaller(whole).to_bytes() == fewer.to_bytes()


def test_places_alike_are_made_one_after_words_are_left_out(views: list[View]) -> None:
    fewer = Learning(words=0.5).smaller(learn(views))
    assert Learning(words=0.5, alike=1.0).smaller(learn(views)).to_bytes() == compact(fewer, 1.0).map.to_bytes()
    assert compact(fewer, 1.0).map.to_bytes() != fewer.to_bytes()
