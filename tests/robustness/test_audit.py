"""The audit's last line never says that all is well when nobody was asked."""

import pytest

from tests.robustness.audit import FOUND, NONE, UNASKED, verdict

GOOD = {"name": "numpy", "version": "2.2.0", "vulns": []}
BAD = {"name": "jinja2", "version": "3.0", "vulns": [{"id": "PYSEC-1", "fix_versions": ["3.1.6"]}]}
UNKNOWN = {"name": "here", "skip_reason": "Dependency not found on PyPI"}


@pytest.mark.parametrize(
    ("packages", "line", "code"),
    [
        ([GOOD, GOOD], "audit: no known weakness in 2 packages", NONE),
        ([GOOD, BAD], "audit: 1 known weaknesses in 2 packages", FOUND),
        ([BAD, UNKNOWN], "audit: 1 known weaknesses in 2 packages; 1 of 2 packages could not be asked about", FOUND),
        ([GOOD, UNKNOWN], "audit: could not ask about 1 of 2 packages: the index does not know them", UNASKED),
        ([], "audit: could not ask about 0 of 0 packages: the index does not know them", UNASKED),
    ],
)
def test_the_last_line_and_the_exit_code(packages, line, code):
    lines, ended = verdict(packages)
    assert (lines[-1], ended) == (line, code)


def test_a_weakness_is_told_with_the_version_that_mends_it():
    assert verdict([BAD])[0][0] == "jinja2 3.0: PYSEC-1, mended in 3.1.6"
