"""``result.json``: what came of a campaign, for programs. Units stand in the names; what is no number is null."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from refseq.files import open_input, replace_text
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.proportion import share_words
from refseq_bench.scenarios.tables import NONE

FORMAT = 2
"""Version of the file's form: another one when a reader of this one would misread it."""
RESULT = "result.json"
RESULT_BYTES = 256 * 2**20
"""Length of a result file that is read [bytes]: a thousand cases of five seeds have 20 million."""
OPEN = "open"
"""Stands for the verdict of a case that was not judged."""


def _number(value: object) -> object:
    """Null for nan and infinity, on which JSON's readers disagree."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


Number = Annotated[float | None, BeforeValidator(_number)]


class Record(BaseModel):
    """A part of the file; keys that a newer bench added are left alone."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class ShareRecord(Record):
    """``right`` of ``of`` views, with a 95 % interval of the share."""

    right: int
    of: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """Right ones among all, nan without any."""
        return self.right / self.of if self.of else math.nan

    @property
    def text(self) -> str:
        """The share with its interval, in words."""
        return share_words(self.share, self.low, self.high)

    @property
    def failed(self) -> str:
        """Number that were not right, in words."""
        return f"{self.of - self.right} of {self.of}" if self.of else NONE


class RunRecord(Record):
    """One method at one seed: ``right`` of ``of`` views within the wider tolerance, and the area under its curve.

    Of missions: 1 of 1 that was completed, and no curve.
    """

    right: int
    of: int
    auc: Number = None


class MethodRecord(Record):
    """One method over all seeds: ``figures`` by their names, with units in them; costs, digests, ``runs`` by seed.

    A digest is of the beliefs, bit for bit but for the time that they took: equal ones are the same answers.
    """

    method: str
    plotted: bool
    within_m: float
    narrow_m: float
    success: ShareRecord
    success_narrow: ShareRecord
    figures: Mapping[str, float | int | str | None]
    costs: Mapping[int, Cost]
    digests: Mapping[int, str]
    runs: Mapping[int, RunRecord] = {}


class JudgementRecord(Record):
    """An expectation and what it was judged by; ``met`` null: it could not be judged, for a reason.

    ``broken`` is one that never can be by these drives, which is an error of the scenario. ``unit`` is that of
    ``value`` and ``bound``; a share is a number from 0 to 1 and told in %.
    """

    text: str
    met: bool | None
    value: Number = None
    bound: Number = None
    unit: str = ""
    reason: str = ""
    broken: bool = False

    @property
    def explanation(self) -> str:
        """Value and bound in words, or why it could not be judged."""
        if self.reason:
            return self.reason
        return f"it is {self._amount(self.value)}; the bound is {self._amount(self.bound)}"

    def _amount(self, value: float | None) -> str:
        if value is None:
            return "without end"
        return f"{value * (100 if self.unit == '%' else 1):.4g} {self.unit}".rstrip()


class MishapRecord(Record):
    """A task that did not end well, with the trace where there is one."""

    verdict: Verdict
    reason: str
    details: str


class SeedRecord(Record):
    """One seed: the keys of what is in the store, and how many views were learnt and asked about."""

    reference: str
    query: str
    further: tuple[str, ...] = ()
    answers: Mapping[str, str]
    learnt_views: int
    asked_views: int


class CaseRecord(Record):
    """One case. ``verdict`` null: not judged, as the campaign was ended before. ``page`` lies beside this file.

    ``schema_type`` says which figures there are: those of ``localising`` or of a ``mission``, whose success is to be
    completed. ``unscored`` says why no view could be judged, empty where some were. ``file`` is the scenario's, null of
    one that does not lie below where the campaign was started.
    """

    schema_type: str = "localising"
    name: str
    scenario: str
    file: str | None = None
    title: str
    blocking: bool
    judged: str
    verdict: Verdict | None = None
    page: str | None = None
    varied: Mapping[str, Any] = {}
    reasons: tuple[str, ...] = ()
    unscored: str = ""
    judgements: tuple[JudgementRecord, ...] = ()
    mishaps: tuple[MishapRecord, ...] = ()
    views: int = 0
    methods: tuple[MethodRecord, ...] = ()
    seeds: Mapping[int, SeedRecord] = {}
    seconds: float = 0.0
    resolved: Mapping[str, Any] = {}

    def method(self, name: str) -> MethodRecord | None:
        """A method's record, None of one that has no answers."""
        return next((one for one in self.methods if one.method == name), None)

    @property
    def verdict_word(self) -> str:
        """The verdict as it is written."""
        return OPEN if self.verdict is None else self.verdict.value

    @property
    def varied_words(self) -> Mapping[str, str]:
        """Varied keys and their values in words."""
        return {key: _words(value) or "none" for key, value in self.varied.items()}

    @property
    def met(self) -> tuple[int, int]:
        """Expectations met, and all."""
        return sum(one.met is True for one in self.judgements), len(self.judgements)


def _words(value: object) -> str:
    """Lists with a plus between, as a case is asked with all of it; tables as ``key value`` pairs."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_words(one)}" for key, one in value.items())
    return " + ".join(map(_words, value)) if isinstance(value, list | tuple) else str(value)


class MachineRecord(Record):
    """Where it ran: ``device`` draws for the default renderer; ``guests``: what users' localisers are kept from."""

    system: str
    processor: str
    cores: int
    memory_gb: Number
    device: str | None
    guests: str = ""


class Versioned(Record):
    """The part of the file that all formats have."""

    format: int = FORMAT


class CampaignRecord(Versioned):
    """The whole file; ``seconds`` is the wall clock from the start to the last verdict."""

    started: str
    seconds: float
    complete: bool
    versions: Mapping[str, str]
    machine: MachineRecord
    cases: tuple[CaseRecord, ...]

    @property
    def began(self) -> str:
        """When it was started, as people write it."""
        return self.started.replace("T", " ").replace("+00:00", " UTC")

    def count(self, verdict: Verdict, *, blocking: bool | None = None) -> int:
        """Cases with a verdict; of those that are blocking or not, None: of all."""
        return sum(one.verdict is verdict and blocking in (None, one.blocking) for one in self.cases)


def by_scenario(cases: Iterable[CaseRecord]) -> dict[str, list[CaseRecord]]:
    """Cases by their scenario, in their order."""
    found: dict[str, list[CaseRecord]] = {}
    for case in cases:
        found.setdefault(case.scenario, []).append(case)
    return found


def cases_by_scenario(campaigns: Iterable[CampaignRecord]) -> dict[str, list[CaseRecord]]:
    """Cases of several campaigns by their scenario; of a case that was judged twice the later counts.

    One that was not judged, as its campaign was ended before, counts only where no other is.
    """
    latest: dict[str, CaseRecord] = {}
    for case in (case for campaign in campaigns for case in campaign.cases):
        if case.verdict is not None or case.name not in latest:
            latest[case.name] = case
    return by_scenario(latest.values())


def write_result(folder: Path, record: CampaignRecord) -> None:
    """Replace the file in one step."""
    replace_text(folder / RESULT, record.model_dump_json(indent=1) + "\n")


def read_result(folder: Path) -> CampaignRecord:
    """Read the result file in a campaign's folder. Raises ``ScenarioError`` for none, or another format."""
    path = folder / RESULT
    try:
        with open_input(path) as file:
            text = file.read(RESULT_BYTES + 1)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}; valid is the folder of a campaign") from error
    if len(text) > RESULT_BYTES:
        raise ScenarioError(f"{path}: is longer than {RESULT_BYTES} bytes, the most that is valid")
    try:
        if (form := Versioned.model_validate_json(text).format) != FORMAT:
            raise ScenarioError(f"{path}: has format {form}; this bench reads {FORMAT}")
        return CampaignRecord.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        told = ": ".join(part for part in (".".join(map(str, first["loc"])), first["msg"]) if part)
        raise ScenarioError(f"{path}: is no result of a campaign: {told}; valid is what a campaign wrote") from error
