from refseq_bench.scenarios.methods.names import METHODS
from refseq_bench.scenarios.report.plot_selection import MOST, select_methods
from refseq_bench.scenarios.scoring.score import Score, score
from tests.support import certain, corridor_comparison


def scores(**right: int) -> dict[str, Score]:
    """Scores of methods with so many right answers of ten."""
    base = corridor_comparison(count=10, size=24)
    found = {}
    for method, count in right.items():
        beliefs = [certain(10, t if t < count else (t + 5) % 10) for t in range(10)]
        found[method.replace("_", "/")] = score(
            type(base)("", base.reference_views, {}, base.query_views, {}, {"m": beliefs}), "m"
        )
    return found


def test_judged_its_stages_the_chains_and_the_best_peers_are_drawn_in_their_order() -> None:
    found = scores(
        thesis_uniform=1, thesis_prior=2, thesis_chain=3, best_uniform=9, best_prior=9, best_chain=8, a=7, b=4, c=10
    )
    expected = ["thesis/uniform", "thesis/prior", "thesis/chain", "best/chain", "a", "c"]
    assert select_methods(list(found), "thesis/chain", found) == expected
    judged_peer = ["thesis/chain", "best/uniform", "best/chain", "a", "b", "c"]
    assert select_methods(list(found), "b", found) == judged_peer


def test_few_are_all_drawn_and_many_never_more_than_can_be_told_apart() -> None:
    assert select_methods(["vlad", "mine:Mine"], "mine:Mine", {}) == ["vlad", "mine:Mine"]
    for judged in METHODS:
        shown = select_methods(METHODS, judged, {})
        assert judged in shown
        assert len(shown) == min(MOST, len(METHODS))
