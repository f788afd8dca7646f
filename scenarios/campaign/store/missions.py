"""A mission that was run, as the store keeps it: the track as a table, all else beside it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from refseq.files import replacing
from refseq.missions.log import Touch
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.missions import MissionLogLine, MissionRun, Ordered

COLUMNS = ("time_s", "true_x_m", "true_y_m", "true_heading_rad", "along_m")
PLAIN = ("completed", "why", "way", "ideal", "optimal", "lost", "views", "refused")


@dataclass(frozen=True)
class KeptMission:
    """A ``run``, what it cost, and the digest of what was believed on it."""

    run: MissionRun
    cost: Cost
    digest: str


def write_mission(path: Path, kept: KeptMission) -> None:
    """Write it in one step. Raises ``OSError``."""
    run = kept.run
    content = {name: getattr(run, name) for name in PLAIN} | {
        "goal": run.goal,
        "touches": [(one.time, one.thing) for one in run.touches],
        "switches": run.switches,
        "orders": [(one.at, one.behaviour, one.why, one.where.tolist()) for one in run.orders],
        "log": [(one.time, None if np.isnan(one.along) else one.along, one.what) for one in run.log],
        "cost": asdict(kept.cost),
        "digest": kept.digest,
    }
    schema = pa.schema([(name, pa.float64()) for name in COLUMNS], metadata={"refseq": json.dumps(content)})
    table = pa.Table.from_arrays([pa.array(column) for column in run.track.T], schema=schema)
    with replacing(path) as file:
        pq.write_table(table, file, write_page_checksum=True)


def read_mission(path: Path) -> KeptMission:
    """The inverse. Raises ``OSError``, ``ValueError``, ``KeyError``, ``TypeError`` or Arrow's for what is none."""
    table = pq.read_table(path, page_checksum_verification=True)
    content: Mapping[str, Any] = json.loads(table.schema.metadata[b"refseq"])
    run = MissionRun(
        **{name: content[name] for name in PLAIN},
        track=np.stack([table[name].to_numpy() for name in COLUMNS], axis=1),
        orders=tuple(
            Ordered(at, behaviour, why, np.array(where, np.float64).reshape(-1, 2))
            for at, behaviour, why, where in content["orders"]
        ),
        switches=tuple((int(number), float(time)) for number, time in content["switches"]),
        log=tuple(
            MissionLogLine(time, np.nan if along is None else along, what) for time, along, what in content["log"]
        ),
        goal=(content["goal"][0], content["goal"][1]),
        touches=tuple(Touch(time, thing) for time, thing in content["touches"]),
    )
    return KeptMission(run, Cost(**content["cost"]), content["digest"])
