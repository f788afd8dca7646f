"""Localisers that a user may have written, in the folder where they stand."""

from pathlib import Path

GOOD = """
import numpy as np
from refseq.belief import Belief, Timings, belief_from

class Sly(Belief):
    path = property(lambda self: dict()["no"], lambda self, value: None)

class Mine:
    def __init__(self, views): self.views = views
    def reset(self): self.seen = []
    def update(self, view):
        self.seen.append(view)
        return {answer}
"""


def written(here: Path, text: str, module: str = "mine.py") -> None:
    (here / module).parent.mkdir(parents=True, exist_ok=True)
    (here / module).write_text(text)
