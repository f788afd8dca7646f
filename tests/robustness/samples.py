"""Small real files to damage: maps, an atlas, a drive and beliefs about it, made once a process."""

import atexit
import os
import shutil
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from refseq.atlas.merge import merge
from refseq.features.dense import DenseSettings
from refseq.features.neural.network import FILE
from refseq.features.sift import SiftSettings
from refseq.logs import RecordingWriter
from refseq.logs.beliefs import write_beliefs
from refseq.map.extractors import FEATURES
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.profile import BEST, THESIS
from refseq.planar import Pose, after_motion
from tests.key_network import write_key_network
from tests.support import corridor_drive

MAPS = ("thesis.refseq", "best.refseq", "atlas.refseq")
DRIVE = "drive.mcap"
BELIEFS = "beliefs.parquet"


SMALL = {"sift": SiftSettings(cap=12), "dense": DenseSettings(columns=2, rows=2, codes=2)}
"""Few words, so that a command is done in a tenth of a second."""


@cache
def samples() -> Path:
    """A folder of ``MAPS``, a ``DRIVE`` of two views, and ``BELIEFS`` about it in the thesis' map."""
    folder = Path(tempfile.mkdtemp(prefix="samples-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ[FILE] = str(write_key_network(folder / "keys.onnx"))  # whatever the user has
    views = corridor_drive(np.random.default_rng(1), count=9, size=48)
    thesis, best = replace(THESIS, **SMALL), replace(BEST, **SMALL)
    learnt = learn(views[:6], profile=thesis, features=tuple(FEATURES))
    learnt.save(folder / "thesis.refseq")
    learn(views[:6], profile=best, features=tuple(FEATURES)).save(folder / "best.refseq")
    merge([learn(views[:6], profile=best, name="first"), learn(views[2:], profile=best, name="second")]).save(
        folder / "atlas.refseq"
    )
    with RecordingWriter(folder / DRIVE, {"world": "corridor"}) as writer:
        pose = Pose(0.0, 0.0, 0.0)
        for view in views[3:5]:
            pose = after_motion(pose, view.distance, view.turn)
            writer.write(view, pose)
    write_beliefs(folder / BELIEFS, views[3:5], localise(learnt, views[3:5]))
    return folder
