"""Make a tiny recording, map, set of answers and mission; print as JSON the bench's files in which code ran for it.

For a process of its own: ``python traced.py FOLDER_OF_LOGS FOLDER``.
"""

import json
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from refseq.map.profile import PROFILES
from refseq_bench.scenarios.campaign.declare import real_recordings
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.campaign.run import learning, mission_task
from refseq_bench.scenarios.campaign.run.answering_code import READER, answering_modules
from refseq_bench.scenarios.campaign.run.case_tasks import mission_tasks
from refseq_bench.scenarios.campaign.run.learning import kept_maps
from refseq_bench.scenarios.campaign.run.tasks import HANDS, AnswerTask, learnt_drives, perform
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.imports.closure import PACKAGES, ROOT
from refseq_bench.scenarios.methods.shelf import Learning
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import StuckError
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.worlds.conftest import SMALL

DRIVEN = """
title = "A drive"
seeds = [1]
[reference]
world = "hallway"
renderer = "none"
[localise]
methods = ["thesis"]
sensors = ["laser"]
"""
MISSION = """
title = "A mission"
seeds = [1]
[reference]
world = "small.toml"
renderer = "none"
behaviours = ["MN:3"]
[mission]
learnt = true
[localise]
methods = ["best/chain"]
"""
REAL = real_recordings.__name__


def _of_answers(*methods: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    modules = answering_modules(methods, HANDS)
    return (*modules.all, REAL), modules.alone


ANSWERING = {"answers": ("thesis/chain",), "vlad": ("topometric", "sequence-graph"), "hamming": ("hamming",)}
"""Kinds of answers: the methods that give them."""
CLOSURES = {
    "recording": ((record.__module__,), ()),
    "map": ((learning.__name__, READER, REAL), HANDS),
    **{kind: _of_answers(*methods) for kind, methods in ANSWERING.items()},
    "mission": ((mission_task.__name__,), ()),
}
"""Modules of which the closure makes the key of each kind, and those that count alone."""


def files_run(call: Callable[[], object]) -> list[str]:
    """The bench's files in which a function ran, in any thread."""
    found: set[str] = set()

    def note(frame: FrameType, _event: str, _argument: object) -> None:
        if frame.f_code.co_name != "<module>":
            found.add(frame.f_code.co_filename)

    # It is called for each function that begins, and as it returns nothing, for none of its lines.
    threading.settrace(note)
    sys.settrace(note)
    try:
        call()
    finally:
        sys.settrace(None)
    names = (Path(file).relative_to(ROOT).as_posix() for file in found if file.startswith(f"{ROOT}{os.sep}"))
    return sorted(name for name in names if name.split("/")[0] in PACKAGES)


def call_for(kind: str, folder: Path) -> Callable[[], object]:
    """Entry points that make something of a ``kind``; keys are reckoned before."""
    (folder / "small.toml").write_text(SMALL.format(top="", end=""))
    store = Store(folder / "store")
    if kind == "recording":
        return lambda: _record_until_no_door_comes(folder)
    if kind == "mission":
        (folder / "mission.toml").write_text(MISSION)
        ((task,),) = mission_tasks(load(folder / "mission.toml")[0]).values()
        for need in task.needs:
            assert perform(need, store).good
        assert task.key
        return lambda: task.carry_out(store)
    methods = ANSWERING.get(kind, ("thesis/chain",))
    asks = AnswerTask(methods, Log("reference.mcap", thin=0.1, noise=1), Log("query.mcap"), "2:8", None, 1, 60.0)
    assert asks.key
    assert asks.maps
    if kind in ANSWERING:
        return lambda: asks.carry_out(store)
    shelf = kept_maps(store, Learning(), lambda profile: profile)
    return lambda: [shelf(profile, drive.views) for drive in learnt_drives(asks, store) for profile in PROFILES]


def _record_until_no_door_comes(folder: Path) -> None:
    drive = Drive(
        world=str(folder / "small.toml"),
        renderer=RendererKind.NONE,
        trigger=Trigger(distance=0.4),
        behaviours=("MC",),
    )
    try:
        record(drive, folder / "drive.mcap")
    except StuckError:
        return
    raise AssertionError("a door was found where there is none")


if __name__ == "__main__":
    os.environ["REFSEQ_RECORDINGS"] = sys.argv[1]
    print(json.dumps({kind: files_run(call_for(kind, Path(sys.argv[2]))) for kind in CLOSURES}))
