"""Missions as people write them: what is read, and what is wrong told in one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.errors import SceneError
from refseq.missions import Call, Errand, MissionError, Photograph, Wait, parse_mission
from refseq.scenes import save_scene
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.missions.file import asked_for, read_mission
from tests.refseq.scenes.drawn import scene

WHOLE = """
title = "Look into the second office"
landmarks = { LA3 = "end", LO1 = 4.5 }

[[step]]
at = "LD"
tasks = [{ photograph = "first" }, { wait = 2.0 }, { call = "greet" }]

[[step]]
at = "LO1"
do = "MT:-90"

[[step]]
at = "LD"
do = "MC"
timeout = 120.0
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_a_file_is_a_string_and_what_belongs_to_its_steps(tmp_path: Path) -> None:
    asked = read_mission(written(tmp_path, WHOLE))
    assert asked.title == "Look into the second office"
    assert str(asked.mission) == "[LD_LO1_LDMC]"
    assert dict(asked.landmarks.places) == {"LA3": "end", "LO1": 4.5}
    assert asked.errands == (
        Errand(None, (Photograph("first"), Wait(2.0), Call("greet"))),
        Errand("MT:-90"),
        Errand(None, (), 120.0),
    )


def test_a_string_and_a_file_that_say_the_same_are_the_same(tmp_path: Path) -> None:
    path = written(tmp_path, '[[step]]\nat = "LD"\n[[step]]\nat = "LD"\ndo = "MC"\n')
    one, other = asked_for("[LD_LDMC]"), asked_for(str(path))
    assert one.mission == other.mission == parse_mission("[LD_LDMC]")
    assert one.errands == other.errands


def test_landmarks_of_the_command_come_on_top_of_the_file_s(tmp_path: Path) -> None:
    asked = asked_for(str(written(tmp_path, WHOLE)), {"LA3": 7.0})
    assert dict(asked.landmarks.places) == {"LA3": 7.0, "LO1": 4.5}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "step: is missing"),
        ("step = []", "step = [] is not valid: "),
        ('[[step]]\nat = "LX"', "step 1: mission '[LX]', column 2: 'LX]'; valid is a landmark: LD, LI, LO, LA"),
        ('[[step]]\nat = "LD_LD"', "step 1: landmark 'LD_LD' is not valid; it should be one landmark, as LA3"),
        ('[[step]]\nat = "LD"\ndo = "MX"', "step 1: mission '[LDMX]', column 4: 'MX]'; valid is a behaviour: "),
        ('[[step]]\nat = "LD"\ndo = "MW:left,0.6"', "step 1: MW is not done at LD; valid are MN, MA, MT, MO, MC"),
        ('[[step]]\nat = "LA1"\ndo = "MN:fast"', "step 1: behaviour 'MN:fast': length 'fast': valid is a number "),
        ('[[step]]\nat = "LD"\nwhen = 3', "step.1.when: is not known here; valid are at, do, tasks, timeout"),
        ('[[step]]\nat = "LD"\ntimeout = 0', "step.1.timeout = 0 is not valid: "),
        ('[[step]]\nat = "LD"\ntasks = [{}]', "step 1: 0 of wait, photograph and call; valid is one of them a task"),
        ('[[step]]\nat = "LD"\ntasks = [{ wait = -1.0 }]', "step.1.tasks.1.wait = -1.0 is not valid: "),
        ('[[step]]\nat = "LD"\ntasks = [{ photograph = "../x" }]', "step.1.tasks.1.photograph = '../x' is not valid: "),
        (
            '[[step]]\nat = "LD"\ntasks = [{ photograph = "x" }]\n[[step]]\nat = "LD"\ntasks = [{ photograph = "x" }]',
            "step 2: photograph 'x' is that of step 1; valid is a name of its own",
        ),
        ('landmarks = { L3 = 1.0 }\n[[step]]\nat = "LD"', "mission '[L3]', column 2: "),
        ("[[step", "is no TOML: "),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, text: str, told: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ScenarioError) as error:
        read_mission(path)
    assert str(error.value).startswith(f"{path}: {told}")
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(
        ScenarioError, match=r"none\.toml: cannot be read: No such file or directory; valid is a mission"
    ):
        asked_for(str(tmp_path / "none.toml"))


def test_a_landmark_that_is_none() -> None:
    with pytest.raises(MissionError, match="landmark 'LA3MN' is not valid"):
        asked_for("[LD]", {"LA3MN": 1.0})


# --- scenes ---


@pytest.fixture
def poster(tmp_path: Path) -> Path:
    save_scene(tmp_path / "poster.scene", scene())
    return tmp_path / "poster.scene"


def test_a_scene_lies_beside_the_mission_s_file_or_is_named_by_the_command(poster: Path) -> None:
    file = written(poster.parent, '[[step]]\nat = "LI1"\ndo = "MT90"\n[scenes]\nLI1 = "poster.scene"\n')
    for asked in (asked_for(str(file)), asked_for("[LI1MT90]", scenes={"LI1": poster})):
        assert (asked.landmarks.scenes["LI1"].patch == scene().patch).all()


@pytest.mark.parametrize(
    ("mission", "name", "places", "told"),
    [
        ("[LD]", "LI1", {}, r"^scene LI1: no step of \[LD\] is at it; valid is a landmark of its steps$"),
        ("[LO1]", "LO1", {}, r"^scene LO1: a scene is an image; valid is a name as LI1$"),
        ("[LI1]", "LI1", {"LI1": 2.0}, r"^LI1 has a place and a scene; valid is one of them$"),
        ("[LI1]", "poster", {}, r"^mission '\[poster\]', column 2"),
    ],
)
def test_a_scene_that_does_not_fit_the_mission_is_told(
    poster: Path, mission: str, name: str, places: dict[str, float | str], told: str
) -> None:
    with pytest.raises(MissionError, match=told):
        asked_for(mission, places, {name: poster})


def test_a_scene_that_cannot_be_found_again_is_told_with_its_file(tmp_path: Path) -> None:
    blank = replace(scene(), patch=np.zeros((180, 200), np.uint8))
    save_scene(tmp_path / "wall.scene", blank)
    with pytest.raises(SceneError, match=r"wall.scene: the scene has 0 keys to know it by; valid are 40 or more"):
        asked_for("[LI1]", scenes={"LI1": tmp_path / "wall.scene"})
    file = written(tmp_path, '[[step]]\nat = "LI1"\n[scenes]\nLI1 = "none.scene"\n')
    with pytest.raises(ScenarioError, match=r"mine.toml: scenes: .*none.scene: cannot be read: No such file"):
        asked_for(str(file))
