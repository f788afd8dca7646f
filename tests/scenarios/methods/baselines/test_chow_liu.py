"""Chow and Liu's tree against all the trees there are."""

import heapq
import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import minimum_spanning_tree

from refseq_bench.scenarios.methods.baselines.chow_liu import (
    PSEUDO,
    ROOT,
    ChowLiuTree,
    best_parents,
    mutual_information,
)

WORDS = 5


def drive(seed: int, views: int, words: int = WORDS) -> np.ndarray:
    """Views (K, N) whose words go together more or less: each copies the last one with some chance."""
    rng = np.random.default_rng(seed)
    shown = rng.random((views, words)) < rng.uniform(0.1, 0.9, words)
    for q in range(1, words):
        copied = rng.random(views) < rng.uniform(0, 0.9)
        shown[copied, q] = shown[copied, rng.integers(q)]
    return shown


def told(x: np.ndarray, y: np.ndarray) -> float:
    """I(x; y) [nat] by its definition."""
    total = 0.0
    for a, b in itertools.product((False, True), repeat=2):
        joint = np.mean((x == a) & (y == b))
        if joint > 0:
            total += joint * math.log(joint / (np.mean(x == a) * np.mean(y == b)))
    return total


def all_trees(n: int) -> Iterator[list[tuple[int, int]]]:
    """The edges of each of the n^(n − 2) trees of n labelled nodes, by Prüfer's sequences."""
    for sequence in itertools.product(range(n), repeat=n - 2):
        degree = [1 + sequence.count(node) for node in range(n)]
        leaves = [node for node in range(n) if degree[node] == 1]
        edges = []
        for node in sequence:
            edges.append((heapq.heappop(leaves), node))
            degree[node] -= 1
            if degree[node] == 1:
                heapq.heappush(leaves, node)
        edges.append((heapq.heappop(leaves), heapq.heappop(leaves)))
        yield edges


def edges(parents: np.ndarray) -> list[tuple[int, int]]:
    return [(q, int(p)) for q, p in enumerate(parents) if p != ROOT]


def probabilities(tree: ChowLiuTree) -> dict[tuple[int, ...], float]:
    """P(z) of all 2^N views."""
    found = {}
    for z in itertools.product((0, 1), repeat=len(tree.parents)):
        p = 1.0
        for q, shown in enumerate(z):
            parent = tree.parents[q]
            rate = tree.marginal[q] if parent == ROOT else tree.given[z[parent], q]
            p *= rate if shown else 1 - rate
        found[z] = p
    return found


def test_there_are_as_many_trees_as_cayley_says() -> None:
    trees = {frozenset(frozenset(edge) for edge in tree) for tree in all_trees(WORDS)}
    assert len(trees) == WORDS ** (WORDS - 2)


@given(st.integers(0, 10_000), st.integers(1, 14))
def test_no_other_tree_tells_more(seed: int, views: int) -> None:
    """Few views make many ties and many words that are the same."""
    shown = drive(seed, views)
    weight = [[told(shown[:, q], shown[:, p]) for p in range(WORDS)] for q in range(WORDS)]
    found = edges(best_parents(csr_array(shown.astype(float))))
    assert len(found) == WORDS - 1
    most = max(sum(weight[q][p] for q, p in tree) for tree in all_trees(WORDS))
    assert sum(weight[q][p] for q, p in found) == pytest.approx(most, abs=1e-9)


@given(st.integers(0, 10_000))
def test_it_is_one_tree_that_grows_from_the_first_word(seed: int) -> None:
    parents = best_parents(csr_array(drive(seed, 6, 12).astype(float)))
    assert parents[0] == ROOT
    for q in range(12):
        way = [q]
        while (up := int(parents[way[-1]])) != ROOT:
            assert up not in way
            way.append(up)
        assert way[-1] == 0


def test_a_large_tree_tells_as_much_as_scipys() -> None:
    shown = drive(4, 25, 90)
    shown[:, 40:60] = shown[:, 10:30]  # words that are the same
    weight = np.array([[told(x, y) for x in shown.T] for y in shown.T])
    # SciPy takes a weight of 0 for no edge, and looks for the least.
    spanning = minimum_spanning_tree(np.triu(10.0 - weight, 1))
    found = sum(weight[q, p] for q, p in edges(best_parents(csr_array(shown.astype(float)))))
    assert found == pytest.approx(10 * 89 - spanning.sum(), abs=1e-9)


@given(st.integers(0, 10_000), st.integers(1, 30))
def test_mutual_information_is_that_of_the_definition(seed: int, views: int) -> None:
    shown = drive(seed, views)
    counts = shown.sum(axis=0)
    together = (shown & shown[:, :1]).sum(axis=0)
    found = mutual_information(views, counts, counts[0], together)
    assert found == pytest.approx([told(x, shown[:, 0]) for x in shown.T], abs=1e-12)


@given(st.integers(0, 10_000), st.integers(1, 30))
def test_all_views_together_have_probability_one_and_the_marginals(seed: int, views: int) -> None:
    shown = drive(seed, views)
    tree = ChowLiuTree.learn(csr_array(shown.astype(float)))
    p = probabilities(tree)
    assert sum(p.values()) == pytest.approx(1)
    assert min(p.values()) > 0
    for q in range(WORDS):
        marginal = (shown[:, q].sum() + PSEUDO) / (views + 2 * PSEUDO)
        assert sum(value for z, value in p.items() if z[q]) == pytest.approx(marginal)
        assert tree.marginal[q] == pytest.approx(marginal)


def test_with_many_views_pairs_go_together_as_they_did() -> None:
    shown = drive(2, 20_000)
    tree = ChowLiuTree.learn(csr_array(shown.astype(float)))
    for q, p in edges(tree.parents):
        for state in (0, 1):
            assert tree.given[state, q] == pytest.approx(shown[shown[:, p] == state, q].mean(), abs=2e-3)


def test_without_edges_words_are_independent() -> None:
    shown = drive(1, 20)
    tree = ChowLiuTree.independent(csr_array(shown.astype(float)))
    assert (tree.parents == ROOT).all()
    assert (tree.given == tree.marginal).all()
    z = (1, 0, 1, 1, 0)
    expected = math.prod(m if shown else 1 - m for m, shown in zip(tree.marginal, z, strict=True))
    assert probabilities(tree)[z] == pytest.approx(expected)


def test_the_state_is_that_of_the_parent() -> None:
    tree = ChowLiuTree(np.array([ROOT, 0, 0, 2]), np.full(4, 0.5), np.full((2, 4), 0.5))
    assert tree.states(np.array([True, False, False, True])).tolist() == [0, 1, 1, 0]


def test_no_words_at_all_are_a_tree_too() -> None:
    tree = ChowLiuTree.learn(csr_array((3, 0)))
    assert tree.parents.shape == (0,)
    assert tree.given.shape == (2, 0)
