"""JUnit XML, as CI servers read it: a suite a scenario, for each case whether it ran and what was expected of it.

Failures and errors are those of ``outcomes.VERDICTS``. What cannot be judged is skipped; so is whatever goes
wrong in a scenario that is not blocking, as a server would fail the build for it.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from junitparser import Attr, Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from refseq.files import replacing_at
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, JudgementRecord, by_scenario

JUNIT = "junit.xml"
RAN = "ran"
NOT_JUDGED = "not judged: the campaign was ended before"
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class Test(TestCase):
    """A test with the scenario's ``file``: what servers lead to from a failure."""

    file = Attr()


def write_junit(folder: Path, record: CampaignRecord) -> None:
    """Replace the file in one step."""
    with replacing_at(folder / JUNIT) as draft:
        junit(record).write(str(draft), pretty=True)


def junit(record: CampaignRecord) -> JUnitXml:
    """The verdicts of a campaign."""
    found = JUnitXml("refseq scenario run")
    for scenario, cases in by_scenario(record.cases).items():
        suite = TestSuite(_clean(scenario))
        # UTC by the format's definition; its schema has no room for a zone.
        suite.timestamp = record.started.removesuffix("+00:00")
        suite.add_property("title", _clean(cases[0].title))
        suite.add_property("blocking", str(cases[0].blocking).lower())
        for case in cases:
            for test in _tests(case):
                suite.add_testcase(test)
        found.add_testsuite(suite)
    return found


def _tests(case: CaseRecord) -> Iterator[TestCase]:
    yield _test(case, RAN, _mishap(case), case.seconds)
    for judgement in case.judgements:
        yield _test(case, judgement.text, _missed(judgement, case), 0.0)


def _test(case: CaseRecord, name: str, result: Failure | Error | Skipped | None, seconds: float) -> TestCase:
    test = Test(_clean(name), _class(case.name), round(seconds, 3))
    if case.file:
        test.file = _clean(case.file)
    if result is not None:
        test.result = [result if case.blocking else _spared(result)]
    unscored = f"not scored: {case.unscored}" if case.unscored and name == RAN else ""
    told = [f"page: {case.page}" if case.page else "", unscored]
    if any(told):
        test.system_out = _clean("\n".join(filter(None, told)))
    return test


def _class(name: str) -> str:
    """A case's name as a class's: servers take all before the last dot for a package, and fold its classes together."""
    return ".".join(part.replace(".", "_") for part in _clean(name).split("/", 1))


def _spared(result: Failure | Error | Skipped) -> Skipped:
    """A failure or error as a skip, where it does not count."""
    if isinstance(result, Skipped):
        return result
    spared = Skipped(f"not blocking, {'error' if isinstance(result, Error) else 'failure'}: {result.message}")
    spared.text = result.text
    return spared


def _mishap(case: CaseRecord) -> Failure | Error | Skipped | None:
    """Failure of a case's tasks, None where all could be done; an error weighs more than a failure."""
    if case.verdict is None:
        return Error(NOT_JUDGED, "bench")
    for verdict, make, kind in ((Verdict.ERROR, Error, "broken"), (Verdict.FAILED, Failure, "robot or localiser")):
        found = [mishap for mishap in case.mishaps if mishap.verdict is verdict]
        broken = any(one.broken for one in case.judgements)
        if found or (verdict is Verdict.ERROR and case.verdict is verdict and not broken):
            # An error in judging is no task's; one of an expectation is told of that.
            result = make(_clean(found[0].reason if found else "; ".join(case.reasons)), kind)
            result.text = _clean("\n".join(f"{one.reason}\n{one.details}".rstrip() for one in case.mishaps))
            return result
    if case.verdict is Verdict.SKIPPED and not case.methods:
        return Skipped(_clean("; ".join(case.reasons)))
    return None


def _missed(judgement: JudgementRecord, case: CaseRecord) -> Failure | Error | Skipped | None:
    if judgement.broken:
        return Error(_clean(judgement.reason), "bench")
    if judgement.met is None:
        return Skipped(_clean(f"not judged: {judgement.reason}"))
    if judgement.met:
        return None
    failure = Failure(_clean(judgement.explanation), "expectation")
    failure.text = _clean(f"{judgement.text}\n{judgement.explanation}\ncase: {case.name}")
    return failure


def _clean(text: str) -> str:
    """A text without the characters that XML does not have, a terminal's colours for one."""
    return _NO_XML.sub("\ufffd", text)
