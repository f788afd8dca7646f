"""Scenes: patches of pictures that a mission may name as landmarks, and their finding by a camera (appendix C, LI)."""

from refseq.scenes.approach import SceneApproach
from refseq.scenes.file import load_scene, save_scene
from refseq.scenes.finder import SceneFinder, SceneSettings, SceneSighting
from refseq.scenes.scene import Box, Scene, cut_scene

__all__ = [
    "Box",
    "Scene",
    "SceneApproach",
    "SceneFinder",
    "SceneSettings",
    "SceneSighting",
    "cut_scene",
    "load_scene",
    "save_scene",
]
