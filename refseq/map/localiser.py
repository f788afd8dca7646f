"""Localising views in a map, at any of the thesis' three stages."""

from collections.abc import Iterable, Mapping, Sequence

from refseq.belief import Belief, Stage, stage_named
from refseq.intake import each_view
from refseq.map.guard import with_faults
from refseq.map.map import Map
from refseq.map.measurer import Measurer
from refseq.map.stage_answers import StageAnswers
from refseq.map.tracking.hindsight import Hindsight
from refseq.view import View


class Localiser:
    """Finds each view's place in a map: reset, then one update a view.

    ``stage`` is how much context is used, ``sensors`` a subset of the map's (default: all). A view that lacks a sensor
    is matched by the others, and so is one whose sensor is declared ill (``Belief.faults``). The same views with the
    same ``seed`` give the same beliefs, bit for bit.

    A belief's ``places`` (K,) are those of all sequences of the map one behind the other, given that the robot is at
    any of them; ``lost`` is the probability that it is at none. Raises ``MapError`` for a sensor that the map does not
    have.
    """

    def __init__(
        self, map_: Map, *, stage: Stage = Stage.CHAIN, sensors: Sequence[str] | None = None, seed: int = 0
    ) -> None:
        self._measurer = Measurer(map_, sensors=sensors, seed=seed)
        self._answers = StageAnswers(map_, stage_named(stage), sensors=sensors)

    def reset(self) -> None:
        """Forget all views seen."""
        self._measurer.reset()
        self._answers.reset()

    def update(self, view: View) -> Belief:
        """Take the next view and answer from the views up to it."""
        self._measurer.take(view)
        return self._answers.update(self._measurer)


class StagedLocaliser:
    """A localiser at several stages at once: each view is matched once for all of them."""

    def __init__(
        self,
        map_: Map,
        *,
        stages: Sequence[Stage] = tuple(Stage),
        sensors: Sequence[str] | None = None,
        seed: int = 0,
    ) -> None:
        self._measurer = Measurer(map_, sensors=sensors, seed=seed)
        self._answers = {stage: StageAnswers(map_, stage, sensors=sensors) for stage in map(stage_named, stages)}

    def update(self, view: View) -> dict[Stage, Belief]:
        """Take the next view and answer at every stage."""
        self._measurer.take(view)
        return {stage: answers.update(self._measurer) for stage, answers in self._answers.items()}


def localise(
    map_: Map,
    views: Iterable[View],
    *,
    stages: Sequence[Stage] = tuple(Stage),
    sensors: Sequence[str] | None = None,
    seed: int = 0,
) -> Mapping[Stage, list[Belief]]:
    """Localise a whole drive at several stages; each view is matched once for all of them.

    ``sensors`` is a subset of the map's (default: all). Raises ``MapError`` for a sensor that the map does not have.
    """
    localiser = StagedLocaliser(map_, stages=stages, sensors=sensors, seed=seed)
    beliefs: dict[Stage, list[Belief]] = {stage_named(stage): [] for stage in stages}
    for view in each_view(views):
        for stage, belief in localiser.update(view).items():
            beliefs[stage].append(belief)
    return beliefs


def smoothed(map_: Map, views: Iterable[View], *, seed: int = 0) -> list[Belief]:
    """The chain's answers in hindsight: each view's in the light of the whole drive, those after it among them.

    They are not what a robot could have known on its way, and are scored apart; ``Hindsight`` tells how, and what it
    raises. As on the way, scans and keys are asked at the places that the views before name, and beliefs tell of the
    faults that stood at their views (``with_faults``).
    """
    measurer, answers, hindsight = Measurer(map_, seed=seed), StageAnswers(map_, Stage.CHAIN), Hindsight(map_)
    stood = []
    for view in each_view(views):
        measurer.take(view)
        answers.follow(measurer)
        hindsight.take(answers.measured)
        stood.append(measurer.view_faults)
    return with_faults(hindsight.beliefs(), stood)
