"""What a view costs that comes over a socket: as a multiple of localising it, and how many there are a second."""

import time
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter, read_recording
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.profile import BEST, THESIS, Profile
from refseq.serve.protocol import ClientChannel
from refseq.serve.session import RobotSession, ServeOptions
from tests.refseq.serve.test_server import in_log
from tests.support import corridor_drive

pytestmark = pytest.mark.benchmark


@pytest.mark.parametrize("profile", [THESIS, BEST], ids=["thesis", "best"])
def test_ten_views_a_second_are_answered(profile: Profile, tmp_path: Path) -> None:
    """Two VGA cameras and a laser, a map of 118 places: the robot's messages are decoded, paired and localised."""
    rng = np.random.default_rng(0)
    map_ = learn(corridor_drive(rng), profile=profile)
    with RecordingWriter(tmp_path / "query.mcap", {}) as writer:
        for view in corridor_drive(rng, 40):
            writer.write(view, view.truth)
    messages = in_log(tmp_path / "query.mcap")
    session = RobotSession(map_, ServeOptions(distance=0))
    told = list(dict.fromkeys((one.topic, one.encoding, one.schema) for one in messages))
    session.advertise(ClientChannel(number, *one) for number, one in enumerate(told))
    numbers = {one[0]: number for number, one in enumerate(told)}
    began = time.process_time()
    answers = [answer for one in messages for answer in session.take(numbers[one.topic], one.data)]
    served = (time.process_time() - began) / len(answers)
    views = read_recording(tmp_path / "query.mcap").views
    localiser = Localiser(map_, seed=1)
    began = time.process_time()
    beliefs = [localiser.update(view) for view in views]
    localised = (time.process_time() - began) / len(beliefs)
    print(f"{served * 1e3:.0f} ms of processor time a view, {localised * 1e3:.0f} of them to localise it")
    assert len(answers) == len(beliefs) == 40
    assert served < 0.1, "10 Hz"
    assert served < 1.5 * localised
