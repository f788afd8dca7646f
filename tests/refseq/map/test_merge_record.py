"""The record of a merging, to a map's header and back, and headers that hold none."""

import json
import math

import pytest

from refseq.map.merge_record import Member, MergeRecord, Ruling

MEMBER = Member("west.refseq", "0" * 64)
RULING = Ruling("west", "east", (0, 4), (3, 7), joined=True)


@pytest.mark.parametrize("least", [None, 0.0, 3.5])
def test_a_record_comes_back_from_a_header(least: float | None) -> None:
    record = MergeRecord((MEMBER,), (RULING,), least)
    content = json.loads(json.dumps(record.to_dict()))
    assert ("min_overlap" in content) == (least is not None), "a map of before has none"
    assert MergeRecord.from_dict(content) == record


@pytest.mark.parametrize("value", [-1, math.nan, math.inf, True, "5", None])
def test_a_shortest_overlap_that_is_no_length_is_refused(value: object) -> None:
    with pytest.raises(ValueError, match=r"^merged\.min_overlap is .*; valid are metres, 0 or more$"):
        MergeRecord.from_dict({"members": [], "rulings": [], "min_overlap": value})
