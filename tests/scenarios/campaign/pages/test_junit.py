from xml.etree import ElementTree

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages.junit import junit
from tests.scenarios.campaign.pages.test_text_report import campaign, case


def test_a_file_name_with_a_terminal_s_colours_is_still_xml() -> None:
    """A scenario goes by its file's name, which may hold any character."""
    coloured = case("red\x1b[31m", Verdict.PASSED, methods=(), judgements=(), seeds={})
    root = ElementTree.fromstring(junit(campaign(coloured)).tostring())
    assert [suite.get("name") for suite in root.iter("testsuite")] == ["red\ufffd[31m"]
