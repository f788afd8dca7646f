"""What each ingredient of the profile ``best`` is worth, in the annex, a world that is not scored.

Two reference drives at 16:00; five drives along the path in other light, each also started a third of the way on; two
detours and one drive backwards, which are off the map for a part or all of it. ``REFSEQ_ANNEX`` names the folder of the
recordings; those that are not there are made first, which takes some minutes.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Timings
from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.matching import detection, log_ratio
from refseq.inference.matching.log_ratio import Calibration
from refseq.inference.matching.mixture import MixtureSettings
from refseq.logs import read_recording
from refseq.map.learning import learn
from refseq.map.matcher import Features, compare
from refseq.map.profile import BEST, THESIS, Decoder, Matching, MethodSettings, Profile
from refseq.map.sequence import ReferenceSequence
from refseq.map.tracking.stages import ChainTracker
from refseq.view import View
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.metrics import auroc
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE
from refseq_bench.scenarios.scoring.score import pool, score

pytestmark = pytest.mark.benchmark

REFERENCES = {"reference": ("16:00", "forward", 1), "reference-2": ("16:00", "forward", 2)}
QUERIES = {
    "late-evening-1001": ("late-evening", "forward", 1001),
    "1800-1001": ("18:00", "forward", 1001),
    "late-evening-1002": ("late-evening", "forward", 1002),
    "1800-1002": ("18:00", "forward", 1002),
    "detour-late-evening-1004": ("late-evening", "detour", 1004),
    "detour-1800-1003": ("18:00", "detour", 1003),
    "reverse-1800-1005": ("18:00", "reverse", 1005),
}
ALL_FEATURES = tuple(dict.fromkeys((*BEST.features, *THESIS.features)))


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, tuple[View, ...]]:
    folder = Path(os.environ.get("REFSEQ_ANNEX") or tmp_path_factory.mktemp("annex"))
    for name, (light, route, seed) in (REFERENCES | QUERIES).items():
        if not (folder / f"{name}.mcap").exists():
            record(Drive(world="annex", light=light, route=route, seed=seed), folder / f"{name}.mcap")
    return {name: read_recording(folder / f"{name}.mcap").views for name in REFERENCES | QUERIES}


@dataclass(frozen=True)
class Seen:
    """A reference drive learnt with every feature, and what was found of them in the query drives."""

    reference: tuple[View, ...]
    learnt: Profile
    queries: Mapping[str, tuple[View, ...]]
    observed: Mapping[str, list[Features]]


class Trial:
    """The annex' drives, looked at once for each set of feature parameters."""

    def __init__(self, drives: Mapping[str, tuple[View, ...]]) -> None:
        self._drives = drives
        self._seen: dict[Profile, list[tuple[Seen, ReferenceSequence]]] = {}

    def comparisons(self, profile: Profile) -> list[Comparison]:
        """The answers of a profile's chain to every drive, from its start and from a third of the way on."""
        features = replace(
            THESIS, features=ALL_FEATURES, **{n: getattr(profile, n) for n in ("sift", "dense", "walls", "doors")}
        )
        if features not in self._seen:
            self._seen[features] = [self._look(name, features) for name in REFERENCES]
        return [one for seen, sequence in self._seen[features] for one in answers(seen, sequence, profile)]

    def _look(self, name: str, features: Profile) -> tuple[Seen, ReferenceSequence]:
        sequence = learn(self._drives[name], profile=features).sequence
        queries = {query: self._drives[query] for query in QUERIES}
        observed = {
            query: [
                {e.key: e.observe(view).ids for e in sequence.extractors if e.sensor in view.sensors} for view in views
            ]
            for query, views in queries.items()
        }
        return Seen(self._drives[name], features, queries, observed), sequence


def shown(sequence: ReferenceSequence, view: View) -> Features:
    """The known features that a view shows."""
    return {e.key: e.observe(view).ids for e in sequence.extractors if e.sensor in view.sensors}


def answers(seen: Seen, everything: ReferenceSequence, profile: Profile) -> list[Comparison]:
    """As a map of the profile's own features would answer: the blocks of the others are left out."""
    kept = tuple(e for e in everything.extractors if e.key.split("/")[0] in profile.features)
    sequence = replace(everything, extractors=kept, profile=profile)
    found = []
    for name, views in seen.queries.items():
        for first in (0, len(views) // 3):
            tracker = ChainTracker(sequence)
            beliefs = [
                tracker.update(
                    compare(
                        sequence,
                        {e.key: ids[e.key] for e in kept if e.key in ids},
                        view.distance,
                        (0, number),
                        Timings(),
                    )
                )
                for number, (view, ids) in enumerate(zip(views[first:], seen.observed[name][first:], strict=True))
            ]
            found.append(Comparison(name, seen.reference, {}, views[first:], {}, {"it": beliefs}))
    return found


def line(name: str, comparisons: list[Comparison]) -> tuple[float, float, int, int, float]:
    """Success within 1.5 m and 0.5 m [%], wrong, false fixes and AUROC of P(lost), over all drives."""
    wide, narrow = (pool([score(c, "it", tolerance) for c in comparisons]) for tolerance in (WIDE, NARROW))
    area = auroc(wide.lost[wide.off_map], wide.lost[wide.on_map])
    assert area is not None
    figures = 100 * wide.success.value, 100 * narrow.success.value
    wrong, false = wide.count(Outcome.WRONG), wide.count(Outcome.FALSE_FIX)
    print(f"{name:44s} {figures[0]:5.1f} {figures[1]:5.1f}  {wrong:5d}  {false:5d}  {area:.3f}", flush=True)
    return *figures, wrong, false, area


def without(*features: str) -> Profile:
    return replace(BEST, features=tuple(name for name in BEST.features if name not in features))


PROFILES: Mapping[str, Profile] = {
    "best": BEST,
    "thesis": THESIS,
    "SIFT as in the thesis": replace(BEST, sift=THESIS.sift),
    "no dense words": without("dense"),
    "no sectors": without("sectors"),
    "no walls, doors, boundary": without("walls", "doors", "boundary"),
    "with Hu moments": replace(BEST, features=(*BEST.features, "hu")),
    "cameras alone": without("walls", "doors", "boundary", "sectors"),
    "no view is ever blind": replace(BEST, log_ratio=replace(BEST.log_ratio, blind=0.0)),
    "the thesis' motion window": replace(BEST, motion=MotionSettings()),
    "places counted, not shared out": replace(BEST, motion=replace(BEST.motion, interpolated=False)),
    "the thesis' chain": replace(BEST, chain=ChainSettings()),
    "Viterbi over five views": replace(BEST, method=MethodSettings(Matching.LOG_RATIO, Decoder.VITERBI)),
    "the mixture, forward filter": replace(
        BEST, method=MethodSettings(Matching.MIXTURE, Decoder.FORWARD), mixture=MixtureSettings()
    ),
}


def uncalibrated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Calibration, "log_ratios", lambda self, scores: np.asarray(scores))


def one_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(detection, "RATES", np.array([0.5]))


def places_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = np.array([1.0, *[0.0] * detection.REACH])
    monkeypatch.setattr(detection, "covisibility", lambda rows: alone)


def equally_common(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every feature's false alarm rate is the same: nothing like an idf is left."""
    init = detection.Detection.__init__

    def even(self: detection.Detection, rows: object) -> None:
        init(self, rows)
        self._counts = np.full_like(self._counts, round(float(self._counts.mean())))

    monkeypatch.setattr(detection.Detection, "__init__", even)


def fixed_calibrator(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_ratio, "log_mean_calibrated", lambda p: np.log(0.5 / np.sqrt(p.high)))


CHANGES: Mapping[str, Callable[[pytest.MonkeyPatch], None]] = {
    "log-ratios taken at their word": uncalibrated,
    "one detection rate, 0.5": one_rate,
    "places share nothing with their neighbours": places_apart,
    "all features equally common": equally_common,
    "calibrator 1 / (2 √p)": fixed_calibrator,
}


def test_what_each_ingredient_is_worth(drives: Mapping[str, tuple[View, ...]], monkeypatch: pytest.MonkeyPatch) -> None:
    trial = Trial(drives)
    print(f"\n{'':44s} success % at  wrong  false  AUROC\n{'':44s} 1.5 m 0.5 m         fixes  P(lost)")
    found = {name: line(name, trial.comparisons(profile)) for name, profile in PROFILES.items()}
    for name, change in CHANGES.items():
        with monkeypatch.context() as patch:
            change(patch)
            line(name, trial.comparisons(BEST))
    best, thesis = found["best"], found["thesis"]
    assert best[4] > 0.95 > thesis[4], "P(lost) of the thesis' chain tells less where the path is left"
    assert best[2] + best[3] < (thesis[2] + thesis[3]) / 5, "wrong answers and false fixes"
