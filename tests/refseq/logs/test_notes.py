"""Notes are kept as they were written, and only text is."""

import pytest

from refseq.errors import LogError
from refseq.logs.notes import LONGEST_NOTES, NOTES, checked_notes, noted


def test_blanks_at_the_ends_of_lines_and_of_the_whole_go() -> None:
    assert checked_notes("  wet floor \r\n\tdoor 3 – half open\t\n\n") == "wet floor\n\tdoor 3 – half open"


def test_nothing_is_noted_where_nothing_was_written() -> None:
    assert noted(" \n ") == {}
    assert noted("rain") == {NOTES: "rain"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x" * (LONGEST_NOTES + 1), "notes have 4001 characters; valid are up to 4000"),
        ("a\x1b[2Jb", r"notes: '\x1b' is no character of a text; "),
        ("a\x00", r"notes: '\x00' is no character"),
        ("a\ud800", r"notes: '\ud800' is no character"),
        ("a\u202eb", r"notes: '\u202e' is no character"),
    ],
)
def test_other_notes_are_refused_in_a_line(text: str, told: str) -> None:
    with pytest.raises(LogError) as caught:
        checked_notes(text)
    assert str(caught.value).startswith(told)
