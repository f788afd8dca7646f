import pytest

from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.guests.limits import SETTING, GuestLimits, limits_here


def test_limits_are_set_by_name() -> None:
    assert limits_here({}) == GuestLimits()
    assert limits_here({SETTING: "memory=16, view=2.5"}) == GuestLimits(memory=16, view=2.5)
    assert limits_here({SETTING: "memory=1"}).memory_bytes == 2**30


@pytest.mark.parametrize(
    "text", ["memory", "memory=", "memory=x", "memory=-1", "memory=0", "view=nan", "view=inf", "x=1"]
)
def test_a_wrong_limit_is_told_with_the_valid_ones(text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        limits_here({SETTING: f"view=1,{text}"})
    assert str(caught.value) == (
        f"{SETTING}: {text!r} is not valid; it should be NAME=NUMBER above 0, names are start, learn, view, memory, "
        "threads, scratch"
    )
