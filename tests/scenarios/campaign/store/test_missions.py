"""A mission as the store keeps it comes back as it was."""

from pathlib import Path

import numpy as np

from refseq.missions.log import Touch
from refseq_bench.scenarios.campaign.store.missions import KeptMission, read_mission, write_mission
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.missions import MissionLogLine, MissionRun


def test_what_was_touched_is_kept_with_its_time(tmp_path: Path) -> None:
    touches = (Touch(1.04, "table:trolley:0"), Touch(2.5, "wall:n1:0"))
    line = MissionLogLine(1.04, 0.5, "touches table:trolley:0")
    run = MissionRun(True, "", np.zeros((2, 5)), (), (), (line,), (0.0, 0.0), 1.0, 1.0, 1.0, touches=touches)
    path = tmp_path / "mission.parquet"
    write_mission(path, KeptMission(run, Cost(0.0, 0.0, 0, 0, None, 0), "digest"))
    back = read_mission(path).run
    assert back.touches == touches
    assert back.touched == ("table:trolley:0", "wall:n1:0")
    assert back.log == (line,)
