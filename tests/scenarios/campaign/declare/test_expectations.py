import math
import operator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.belief import Timings
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.campaign.declare.expectations import SUFFIXES, Expectation, Term, about, parse
from refseq_bench.scenarios.campaign.declare.figures import FIGURES, Unit
from refseq_bench.scenarios.campaign.judge.expectations import judge
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import Figures, figures
from tests.support import certain

METHODS = st.sampled_from(
    ["thesis/chain", "best/uniform", "thesis+chain.window=20/chain", "topometric", "my.own:Localiser"]
)
NUMBERS = st.floats(-1e6, 1e6, allow_nan=False).map(lambda value: value + 0.0)
LEFT = st.builds(Term, st.sampled_from(sorted(FIGURES)), st.none() | METHODS)


def as_text(expectation: Expectation) -> str:
    """An expectation written out."""
    right = expectation.right
    bound = _scaled_as_text(right) if isinstance(right, Term) else repr(right)
    over = f" over {expectation.seeds} seeds" if expectation.seeds > 1 else ""
    return f"{_term_as_text(expectation.left)} {expectation.relation} {bound}{over}"


def _scaled_as_text(term: Term) -> str:
    return _term_as_text(term) if term.factor == 1 else f"{term.factor!r} * {_term_as_text(term)}"


def _term_as_text(term: Term) -> str:
    return term.figure if term.method is None else f"{term.figure} of {term.method}"


@st.composite
def expectations(draw: st.DrawFn) -> Expectation:
    left = draw(LEFT)
    unit = FIGURES[left.figure].unit
    number = {Unit.SHARE: st.floats(0, 1), Unit.NONE: NUMBERS}.get(unit, NUMBERS.map(abs))
    same = sorted(name for name, figure in FIGURES.items() if figure.unit is unit)
    right = st.builds(Term, st.sampled_from(same), st.none() | METHODS, NUMBERS).filter(
        lambda term: (term.figure, term.method) != (left.figure, left.method)
    )
    relation = draw(st.sampled_from([">=", "<=", ">", "<"]))
    one = Expectation("", left, relation, draw(right | number), draw(st.integers(1, 99)))
    return replace(one, text=as_text(one))


@given(expectations())
def test_what_is_written_out_is_read_back(one: Expectation) -> None:
    assert parse(one.text, "thesis") == one


def complaint(text: str) -> str:
    """What is said of an expectation, nothing of one that can be read."""
    try:
        parse(text, "thesis")
    except ScenarioError as error:
        return str(error)
    return ""


@given(st.text())
def test_whatever_is_written_is_read_or_told_in_one_line(text: str) -> None:
    message = complaint(text)
    assert not message or (repr(text) in message and "valid" in message and "\n" not in message)


PIECES = ["success", "success_hmm", "to_lost", "of", "thesis/chain", ">=", "<", "0.8", "80", "%", "5", "m", "*", "over",
          "seeds", "seed", "-1", "1e3", "views", "ms"]  # fmt: skip


@given(st.lists(st.sampled_from(PIECES), max_size=12), st.sampled_from(["", " ", "  ", "\t"]))
def test_pieces_of_the_grammar_in_any_order_are_read_or_told(pieces: list[str], between: str) -> None:
    text = between.join(pieces)
    if message := complaint(text):
        assert "valid" in message
    else:
        one = parse(text, "thesis")
        assert parse(as_text(one), "thesis") == replace(one, text=as_text(one))


CHAIN, UNIFORM = "thesis/chain", "thesis/uniform"
SAME = [
    ("success >= 80%", "success", None, ">=", 0.8, 1),
    ("  success  >=80 %  ", "success", None, ">=", 0.8, 1),
    ("success≥.8", "success", None, ">=", 0.8, 1),
    ("success_hmm >= 0.80 over 5 seeds", "success", CHAIN, ">=", 0.8, 5),
    ("success_narrow_uniform > 1 over 1 seed", "success_narrow", UNIFORM, ">", 1.0, 1),
    ("success of my:Own>=1e-1", "success", "my:Own", ">=", 0.1, 1),
    ("to_lost <= 5 m", "to_lost", None, "<=", 5.0, 1),
    ("to_lost_hmm<=5m", "to_lost", CHAIN, "<=", 5.0, 1),
    ("milliseconds < 20 ms", "milliseconds", None, "<", 20.0, 1),
    ("failures <= 1 view", "failures", None, "<=", 1.0, 1),
    ("failures <= 12 views over 5 seeds", "failures", None, "<=", 12.0, 5),
    ("lost_auroc of topometric ≤ 0.9", "lost_auroc", "topometric", "<=", 0.9, 1),
    ("failures_hmm <= 0.5 * failures_uniform", "failures", CHAIN, "<=", Term("failures", UNIFORM, 0.5), 1),
    ("failures <= 50 % of failures of vlad over 2 seeds", "failures", None, "<=", Term("failures", "vlad", 0.5), 2),
    ("error_p95 <= 3 * error_median of vlad", "error_p95", None, "<=", Term("error_median", "vlad", 3.0), 1),
    ("missed<=50%*failures", "missed", None, "<=", Term("failures", None, 0.5), 1),
    ("success > success of vlad", "success", None, ">", Term("success", "vlad", 1.0), 1),
]


@pytest.mark.parametrize(("text", "figure", "method", "relation", "right", "seeds"), SAME)
def test_what_people_write(
    text: str, figure: str, method: str | None, relation: str, right: Term | float, seeds: int
) -> None:
    assert parse(text, "thesis") == Expectation(text, Term(figure, method), relation, right, seeds)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("success", "'success' is no expectation; valid is FIGURE"),
        ("success = 0.8", "'success = 0.8' is no expectation; valid is FIGURE"),
        ("success => 0.8", "'success => 0.8' is no expectation; valid is FIGURE"),
        ("success >= 80 percent", "'success >= 80 percent' is no expectation"),
        ("success >= nan", "'success >= nan': figure 'nan' is unknown; valid are success"),
        ("success >= ٣", "'success >= ٣' is no expectation"),
        ("succes >= 0.8", "'succes >= 0.8': figure 'succes' is unknown; valid are success, success_narrow"),
        ("success_chain >= 0.8", "'success_chain >= 0.8': figure 'success_chain' is unknown; valid are success"),
        ("success >= 80", "'success >= 80': success is a share; valid is 0 to 1, or 0 % to 100 %"),
        ("success >= 180 %", "'success >= 180 %': success is a share; valid is 0 to 1, or 0 % to 100 %"),
        ("success >= 5 m", "'success >= 5 m': success is not told in m; valid is %"),
        ("to_recover <= -3 m", "'to_recover <= -3 m': to_recover is never below 0; valid is 0 or more"),
        ("to_lost <= 5 %", "'to_lost <= 5 %': to_lost is not told in %; valid is m"),
        ("to_lost <= 5 ms", "'to_lost <= 5 ms': to_lost is not told in ms; valid is m"),
        ("failures <= 10 %", "'failures <= 10 %': failures is not told in %; valid is views"),
        ("ece <= 5 %", "'ece <= 5 %': ece is not told in %; valid is no unit"),
        ("failures <= 5 m * failures", "'failures <= 5 m * failures': 5 m times a figure is not valid"),
        (
            "to_lost <= 2 * success",
            "'to_lost <= 2 * success': units of to_lost (m) and success (%) differ; valid are two",
        ),
        ("success_hmm >= failures", "'success_hmm >= failures': units of success (%) and failures (views) differ; "),
        ("ece < 5 % of recall_1", "'ece < 5 % of recall_1': units of ece (no unit) and recall_1 (%) differ; valid are"),
        (
            "success >= success",
            "'success >= success': compares success with itself; valid are a number, another figure",
        ),
        (
            "failures of vlad < 2 * failures of vlad over 2 seeds",
            "'failures of vlad < 2 * failures of vlad over 2 seeds': ",
        ),
        ("success_hmm of vlad >= 0.8", "'success_hmm of vlad >= 0.8': success_hmm is that of thesis/chain already; "),
        ("success >= 0.8 over 0 seeds", "'success >= 0.8 over 0 seeds': over 0 seeds is not valid; it should be 1"),
        (f"success >= 0.8 over {5000 * '9'} seeds", f"'success >= 0.8 over {5000 * '9'} seeds' is no expectation"),
        ("failures <= 1e999", "'failures <= 1e999': 1e999 is not valid; it should be finite"),
        ("success >= 0.8 over 1.5 seeds", "'success >= 0.8 over 1.5 seeds' is no expectation"),
    ],
)
def test_what_is_none_is_told(text: str, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(text, "thesis")
    assert str(caught.value).startswith(message)


# --- judging ---


def found(**right: int) -> dict[str, Figures]:
    """Figures of methods that answer so many of four views right."""
    reference = [View(0.0, truth=Pose(10.0 * k, 0.0, 0.0)) for k in range(2)]
    query = [View(0.0, truth=Pose(0.0, 0.0, 0.0))] * 4
    beliefs = {name: [certain(2, int(k >= count)) for k in range(4)] for name, count in right.items()}
    return {one.method: one for one in figures([Comparison("test", reference, {}, query, {}, beliefs)])}


@settings(deadline=None)
@given(st.integers(0, 4), st.integers(0, 4), st.sampled_from([">=", "<=", ">", "<"]), st.integers(0, 4))
def test_a_judgement_is_the_comparison(mine: int, yours: int, relation: str, percent: int) -> None:
    compare = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}[relation]
    by_method = found(mine=mine, yours=yours)
    one = judge(parse(f"success {relation} {25 * percent} %", "thesis"), by_method, "mine", 1)
    assert (one.met, one.value, one.bound) == (compare(mine, percent), mine / 4, percent / 4)
    one = judge(parse(f"failures {relation} 2 * failures of yours", "thesis"), by_method, "mine", 1)
    assert (one.met, one.value, one.bound) == (compare(4 - mine, 2 * (4 - yours)), 4 - mine, 2 * (4 - yours))


def test_what_nobody_answered_is_not_judged() -> None:
    of_mine, of_vlad = parse("success >= 0", "thesis"), parse("success of vlad >= 0", "thesis")
    assert judge(of_mine, found(vlad=4), "mine", 1).reason == "mine has no answers"
    assert judge(of_vlad, found(mine=4), "mine", 1).reason == "vlad has no answers"
    assert judge(parse("success > success of vlad", "thesis"), found(mine=4), "mine", 1).met is None
    # Who is judged does not matter where all methods are named.
    assert judge(of_vlad, found(vlad=4), "mine", 1).met is True


def test_too_few_seeds_are_not_judged() -> None:
    one = judge(parse("success >= 0 over 5 seeds", "thesis"), found(mine=4), "mine", 4)
    assert (one.met, one.reason) == (None, "4 seeds of the 5 that it asks for were run")
    none = judge(parse("success >= 0", "thesis"), found(mine=4), "mine", 0)
    assert (none.met, none.reason) == (None, "no seed was run to its end")


def test_a_figure_that_is_not_there_was_not_reached() -> None:
    one = judge(parse("lost_auroc <= 1", "thesis"), found(mine=4), "mine", 1)
    assert one.met is False
    assert one.value is None
    assert one.reason == "there is no such figure: nothing to take it from"


def taken(reference: list[float], *asked: tuple[float, float, int, float]) -> dict[str, float]:
    """All figures of a method in a map of places at these x [m]; asked are x, y [m], its answer and its P(lost)."""
    timings = Timings(features=0.5, matching=0.001, chain=0.002)
    beliefs = [replace(certain(len(reference), place, lost), timings=timings) for *_, place, lost in asked]
    places, query = (
        [View(0.0, truth=Pose(x, y, 0.0)) for x, y in where]
        for where in ([(x, 0.0) for x in reference], [(x, y) for x, y, *_ in asked])
    )
    (found,) = figures([Comparison("test", places, {}, query, {}, {"mine": beliefs})])
    return {name: figure.take(found) for name, figure in FIGURES.items()}


def test_each_figure_is_what_it_is_called() -> None:
    values = taken(
        [0, 1, 4, 8, 12, 16],
        (0, 0, 1, 0.0),  # right, but for the narrow tolerance; a place too far
        (4.8, 0, 2, 0.0),  # right, and for the narrow tolerance off the map
        (4, 0, 5, 0.0),  # wrong by three places
        (12, 0, 4, 0.9),  # missed
        (12, 9, 4, 0.2),  # a false fix
        (12, 12, 4, 0.8),  # rejected
        (12, 14, 4, 0.7),
        (15.6, 0, 0, 0.0),  # wrong by five places
        (16, 0, 5, 0.0),  # right
    )
    by_hand = {
        "success": 3 / 6, "success_narrow": 1 / 5, "within_1_place": 3 / 6, "within_2_places": 3 / 6,
        "within_5_places": 5 / 6, "failures": 3, "failures_narrow": 4, "wrong": 2, "missed": 1, "false_fixes": 1,
        "recall_1": 4 / 6, "lost_auroc": 15 / 18, "lost_fpr": 1 / 6, "error_median": 1.0,
        "error_p95": 12 + 0.8 * 3.6, "worst_false_fix": 9.0, "to_lost": 3.0, "to_recover": 0.4, "to_first_fix": 0.0,
        "milliseconds": 3.0, "lost_ece": (0.9 + 0.8 + 0.2 + 0.3) / 9, "ece": 2 / 6, "entropy_auroc": 0.5,
    }  # fmt: skip
    assert {name: values[name] for name in by_hand} == pytest.approx(by_hand)
    assert math.isnan(values["harm"])  # the method has no single view to be compared with


def test_recall_is_taken_at_the_precision_that_it_is_called_after() -> None:
    values = taken([0.0, 9.0], *[(0.0, 0.0, 0, 0.0)] * 100, (0.0, 0.0, 1, 0.1), (0.0, 0.0, 0, 0.2))
    assert (values["recall_at_100"], values["recall_at_99"]) == pytest.approx((100 / 102, 101 / 102))


def test_a_way_that_was_never_gone_is_longer_than_all_others() -> None:
    values = taken([0.0], (0, 0, 0, 0), (0, 9, 0, 0), (0, 0, 0, 0), (0, 9, 0, 1), (0, 0, 0, 0), (0, 9, 0, 0))
    assert math.isinf(values["to_lost"])  # once at once, twice never
    assert math.isnan(taken([0.0], (0, 0, 0, 0))["to_lost"])


def test_who_does_nothing_wrong_misses_no_expectation_about_failures() -> None:
    path = [View(0.0, truth=Pose(float(x), 0.0, 0.0)) for x in range(4)]
    away = [View(0.0, truth=Pose(0.0, 50.0, 0.0))]
    good = [*(certain(4, place) for place in range(4)), certain(4, 3, 0.99)]
    timid = [certain(4, 3, 0.99)] * 5
    found = figures([Comparison("test", path, {}, [*path, *away], {}, {"good": good, "timid": timid})])
    by_method = {one.method: one for one in found}
    texts = ("worst_false_fix <= 5 m", "entropy_auroc >= 0.5", "entropy_auroc of timid >= 0.5")
    worst, entropy, nothing_right = (judge(parse(text, "thesis"), by_method, "good", 1) for text in texts)
    assert (worst.met, worst.value) == (True, 0.0)
    assert (entropy.met, entropy.reason) == (None, "good has no entropy_auroc, as none of its answers is wrong")
    assert nothing_right.met is False, "nor is any right"


def test_a_figure_that_is_compared_with_itself_by_who_is_judged_now_decides_nothing() -> None:
    one = parse("success >= success of vlad", "thesis")
    assert judge(one, found(vlad=4), "vlad", 1).reason == "compares success of vlad with itself"
    assert judge(one, found(vlad=4), "vlad", 1).met is None
    assert judge(one, found(vlad=4, mine=4), "mine", 1).met is True


def test_every_figure_has_a_meaning_and_no_stage_s_ending() -> None:
    assert all(figure.meaning for figure in FIGURES.values())
    assert not any(name.endswith(tuple(SUFFIXES)) for name in FIGURES)


def test_an_expectation_can_be_made_of_another_method() -> None:
    one = parse("success > success of vlad over 2 seeds", "thesis")
    assert about(one, "mine").text == "success of mine > success of vlad over 2 seeds"
    named = parse("success_hmm > 0.5", "thesis")
    assert about(named, "mine") == named


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("success >= 50 %", "success of mine >= 50 %"),
        ("false_fixes<=5 views over 3 seeds", "false_fixes of mine<=5 views over 3 seeds"),
        ("failures ≤ 50 % of failures of vlad", "failures of mine ≤ 50 % of failures of vlad"),
        ("failures of vlad > failures", "failures of vlad > failures of mine"),
        ("wrong <= .5*failures over 2 seeds", "wrong of mine <= .5*failures of mine over 2 seeds"),
        ("failures_hmm <= failures", "failures_hmm <= failures of mine"),
    ],
)
def test_an_expectation_keeps_its_words_when_it_is_made_of_another_method(text: str, told: str) -> None:
    one = about(parse(text, "thesis"), "mine")
    assert one.text == told
    assert parse(told, "thesis") == one
