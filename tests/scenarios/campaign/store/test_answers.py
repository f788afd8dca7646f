import math
from dataclasses import replace

import numpy as np

from refseq.belief import Belief, Timings
from refseq_bench.scenarios.campaign.store.answers import beliefs_digest

BELIEF = Belief(np.array([0.25, 0.75]), 0.5, 1, (0, 1), 0.56)


def test_a_digest_is_of_all_but_the_times() -> None:
    assert beliefs_digest([BELIEF]) == beliefs_digest([replace(BELIEF, timings=Timings(chain=1.0))])
    others = (
        replace(BELIEF, places=np.nextafter(BELIEF.places, 1)),
        replace(BELIEF, lost=math.nextafter(0.5, 1)),
        replace(BELIEF, best=0),
        replace(BELIEF, path=(1, 1)),
        replace(BELIEF, entropy=math.nextafter(0.56, 1)),
    )
    assert len({beliefs_digest([one]) for one in (BELIEF, *others)}) == 6
    assert beliefs_digest([BELIEF, others[0]]) != beliefs_digest([others[0], BELIEF])
