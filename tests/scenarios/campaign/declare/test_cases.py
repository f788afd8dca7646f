"""Scenario files that are read, and those that are refused: one line that names the file, the key, the value."""

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import find, load
from refseq_bench.scenarios.campaign.declare.checks.drivable import check_route
from refseq_bench.scenarios.campaign.declare.figures import FIGURES
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError, place_below, read_real
from refseq_bench.scenarios.campaign.declare.schema import Scenario
from refseq_bench.scenarios.campaign.declare.sources import Images, Log
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.drives.drive import QUERY_SEEDS, Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.faults import CameraBlack
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.signal_faults import SignalFault, SignalFaultKind
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser_model import RangeMode

REFERENCE = '[reference]\nworld = "hallway"\nrenderer = "none"\nend = 20.0\n'
GOOD = (
    f'title = "T"\nseeds = [1, 2]\nexpect = ["success_hmm >= 80 % over 2 seeds"]\n{REFERENCE}[query]\nlight = "18:00"\n'
)
HEAD = 'title = "T"\n'
BODY = f'{REFERENCE}[query]\nlight = "18:00"\n'


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "mine.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def only_case(folder: Path, text: str) -> Case:
    (case,) = load(written(folder, text))
    return case


def with_signal(fault: str) -> str:
    """A good scenario with a fault of a signal."""
    return f"{GOOD}[localise]\nsignal_faults = [{{ {fault} }}]\n"


BAD = {
    "a signal's fault of no kind": (
        with_signal('kind = "bored"'),
        "localise.signal_faults.0.kind = 'bored' is not valid: input should be 'camera-blank', 'camera-frozen'",
    ),
    "a signal's fault with an unknown key": (
        with_signal('kind = "laser-frozen", form = 1.0'),
        "localise.signal_faults.0.form: is not known here; valid are kind, at, until, camera, other, bearing",
    ),
    "a signal's fault whose number is a text": (
        with_signal('kind = "laser-frozen", at = "1.0"'),
        "localise.signal_faults.0: at = '1.0' is not valid; it should be a number",
    ),
    "a signal's fault that ends before it begins": (
        with_signal('kind = "laser-frozen", at = 5.0, until = 2.0'),
        "fault laser-frozen: at = 5 m, until = 2 m; valid is 0 <= at < until",
    ),
    "a signal's fault that jumps for ever": (
        with_signal('kind = "clock-jumping", seconds = inf'),
        "fault clock-jumping: seconds = inf is not valid; it should be finite",
    ),
    "a signal's fault of no camera": (
        with_signal('kind = "camera-blank"'),
        "fault camera-blank: camera is missing; valid is the name of a camera",
    ),
    "a signal's fault of a camera that the robot lacks": (
        with_signal('kind = "cameras-exchanged", camera = "forward", other = "behind"'),
        "localise.signal_faults: ",
    ),
    "a signal's fault beyond the end": (
        with_signal('kind = "laser-blind", at = 500.0'),
        "localise.signal_faults: fault laser-blind: at = 500 m is beyond the end of what is driven; valid is 0 to ",
    ),
    "a signal's fault of a sensor that is not looked at": (
        with_signal('kind = "camera-blank", camera = "camera-1"').replace('"none"', '"classic"')
        + 'sensors = ["laser", "camera-2"]\n',
        "localise.signal_faults: fault camera-blank: nothing is taken of 'camera-1' here; valid are laser, camera-2",
    ),
    "a signal's fault of a camera where none takes pictures": (
        with_signal('kind = "camera-blank", camera = "camera-1"'),
        "localise.signal_faults: fault camera-blank: nothing is taken of 'camera-1' here; valid are laser",
    ),
    "a camera that turns black where none takes pictures": (
        GOOD + 'faults = [{ kind = "camera-black", camera = "camera-1", at = 1.0, until = 2.0 }]\n',
        "query: fault camera-black: nothing is taken of 'camera-1' here; valid are laser",
    ),
    "nothing at all": ("", "title: is missing"),
    "TOML syntax": ("title = \n", "is no TOML: Invalid value (at line 1, column 9); valid is a scenario in TOML"),
    "not UTF-8": (b'title = "\xff"', "cannot be read: not UTF-8 text; valid is a scenario in TOML"),
    "too deep": ("a = " + "[" * 3000, "tables or arrays are more than 32 deep in each other"),
    "no query's world": (HEAD + '[query]\nlight = "18:00"\n', "reference: is missing"),
    "no title": (BODY, "title: is missing"),
    "a title of the wrong type": ("title = 3\n" + BODY, "title = 3 is not valid: input should be a valid string"),
    "unknown key": (HEAD + 'tiltle = "T"\n' + BODY, "tiltle: is not known here; valid are title, source, note, tags"),
    "unknown key of a drive": (
        GOOD + 'lihgt = "noon"\n',
        "query.lihgt: is not known here; valid are world, robot, light",
    ),
    "a table's unknown key": (
        GOOD + "[score]\nwidth = 3\n",
        "score.width: is not known here; valid are within, narrow",
    ),
    "key with a line break": (HEAD + '"a\\nb" = 1\n' + BODY, "'a\\nb': is not known here; valid are title"),
    "a table that is none": (HEAD + "query = 3\n" + REFERENCE, "query: is no table; valid is [query]"),
    "text for a flag": (
        HEAD + 'blocking = "no"\n' + BODY,
        "blocking = 'no' is not valid: input should be a valid boolean",
    ),
    "text for a length": (GOOD + 'start = "5"\n', "query.start = '5' is not valid: input should be a valid number"),
    "no number": (GOOD + "start = nan\n", "query.start = nan is not valid: input should be a finite number"),
    "light": (HEAD + REFERENCE + '[query]\nlight = "dusk"\n', "query: unknown light 'dusk'; known are morning"),
    "hour": (HEAD + REFERENCE + '[query]\nlight = "25:00"\n', "query: unknown light '25:00'"),
    "a time of TOML's": (
        HEAD + REFERENCE + "[query]\nlight = 08:00:00\n",
        "query.light = datetime.time(8, 0) is not val",
    ),
    "world": (GOOD + 'world = "palace"\n', "query: unknown world 'palace'; known are annex"),
    "floor plan that is not there": (GOOD + 'world = "no.toml"\n', "query: "),
    "route": (GOOD + 'route = "up"\n', "query: unknown route 'up' in world 'hallway': valid are forward"),
    "end behind the route's": (GOOD + "end = 500.0\n", "query: start 0.0 m and end 500 m are no stretch of route"),
    "start behind end": (GOOD + "start = 20.0\n", "query: start 20.0 m and end 20 m are no stretch of route"),
    "too short to learn from": (
        GOOD.replace("end = 20.0", "end = 0.1"),
        "reference: forward from 0 m to 0.1 m: 0.1 m, too short to learn from; valid are 0.85 m or more",
    ),
    "one waypoint": (GOOD + "waypoints = [[1.0, 1.0]]\n", "query: one of waypoints is no route; valid are"),
    "waypoint in space": (GOOD + "waypoints = [[1.0, 1.0, 1.0]]\n", "query.waypoints.0 = [1.0, 1.0, 1.0] is not valid"),
    "change": (GOOD + 'change = "earthquake"\n', "query: change 'earthquake': unknown"),
    "robot": (GOOD + 'robot = "r2d2"\n', "query: unknown robot 'r2d2': valid are robuter"),
    "renderer": (GOOD + 'renderer = "crayon"\n', "query.renderer = 'crayon' is not valid: input should be 'baked'"),
    "dial of the operator": (GOOD + "operator = 99\n", "query.operator = 99 is not valid: input should be less than"),
    "dial of the world": (
        GOOD + 'world = "building:3,width=20"\n',
        "query: world 'building:3,width=20': width = '20' is not valid; it should be from 1.8 to 4",
    ),
    "laser": (GOOD + "laser_range = 20\n", "query.laser_range = 20 is not valid: input should be 8 or 80"),
    "sensor": (GOOD + '[localise]\nsensors = ["nose"]\n', "reference: sensor 'nose' is not on robot 'robuter'; valid"),
    "no sensor": (
        GOOD + "[localise]\nsensors = []\n",
        "localise.sensors holds too little; it should be a list of 1 or more",
    ),
    "a sensor twice": (
        GOOD + '[localise]\nsensors = ["laser", "laser"]\n',
        "reference: sensors: laser is named twice; valid is once",
    ),
    "nothing to see": (GOOD + '[localise]\nsensors = ["camera-1"]\n', "reference: renderer 'none' takes no images"),
    "camera": (GOOD + '[query.cameras]\ncamera-9 = "fire-i"\n', "query: sensor 'camera-9' is not on robot 'robuter'"),
    "camera's model": (GOOD + '[query.cameras]\ncamera-1 = "obscura"\n', "query: unknown camera 'obscura': valid are"),
    "fault's kind": (
        GOOD + '[[query.faults]]\nkind = "ghost"\n',
        "query.faults.0: kind 'ghost' is unknown; valid are 'kid",
    ),
    "no kind": (GOOD + "[[query.faults]]\nat = 1\n", "query.faults.0: kind is missing"),
    "half a fault": (GOOD + '[[query.faults]]\nkind = "kidnap"\nat = 1\n', "query.faults.0.to: is missing"),
    "fault's key": (
        GOOD + '[[query.faults]]\nkind = "kidnap"\nat = 1\nto = 2\nby = "ET"\n',
        "query.faults.0.by: is not known here; valid are at, to, kind",
    ),
    "text for a fault's number": (
        GOOD + '[[query.faults]]\nkind = "kidnap"\nat = "1"\nto = 2\n',
        "query.faults.0: at = '1' is not valid; it should be a number",
    ),
    "fault beyond the end": (
        GOOD + '[[query.faults]]\nkind = "wheel-slip"\nat = 20.5\nseconds = 2.0\n',
        "query: fault wheel-slip: at = 20.5 m is beyond the end of what is driven; valid is 0 to 20.0 m",
    ),
    "kidnap to nowhere": (
        GOOD + '[[query.faults]]\nkind = "kidnap"\nat = 1\nto = 90\n',
        "query: fault kidnap: to = 90 m is beyond the end of what is driven; valid is 0 to 20.0 m",
    ),
    "fault that outlasts the drive": (
        GOOD + '[[query.faults]]\nkind = "camera-black"\nat = 5\nuntil = 20.5\ncamera = "camera-1"\n',
        "query: fault camera-black: until = 20.5 m is beyond the end of what is driven; valid is 0 to 20.0 m",
    ),
    "fault back in time": (
        GOOD + '[[query.faults]]\nkind = "camera-black"\nat = 5\nuntil = 4\ncamera = "camera-1"\n',
        "fault camera-black: until = 4.0 m must be beyond at = 5.0 m",
    ),
    "fault of a camera that is not there": (
        GOOD + '[[query.faults]]\nkind = "camera-black"\nat = 5\nuntil = 6\ncamera = "nose"\n',
        "query: fault camera-black: camera 'nose' is not on robuter; valid are camera-1, camera-2",
    ),
    "trigger": (
        GOOD + "[query.trigger]\nlength = 1\n",
        "query.trigger.length: is not known here; valid are distance, tu",
    ),
    "seeds twice": (
        HEAD + "seeds = [1, 2, 1]\n" + BODY,
        "seeds: [1, 2, 1] holds one twice; valid are seeds that differ",
    ),
    "seeds of which nothing is drawn": (
        HEAD + 'seeds = [3, 4]\n[reference]\nlog = "a.log"\n[query]\nimages = "b"\n',
        "seeds: [3, 4]: nothing is drawn from a seed here, and the same views would be counted 2 times; valid is one "
        "seed, such as [1]",
    ),
    "no seeds": (HEAD + "seeds = []\n" + BODY, "seeds holds too little; it should be a list of 1 or more"),
    "one seed": (HEAD + "seeds = 2\n" + BODY, "seeds = 2 is not valid; it should be a list in brackets"),
    "one expectation": (
        HEAD + 'expect = "success >= 0"\n' + BODY,
        "expect = 'success >= 0' is not valid; it should be a list in brackets",
    ),
    "a narrow tolerance that is wide": (
        GOOD + "[score]\nwithin = 0.2\nnarrow = 2.0\n",
        "score: narrow = 2 is wider than within = 0.2; valid is less, or as much",
    ),
    "a seed below 0": (HEAD + "seeds = [1, -2]\n" + BODY, "seeds.1 = -2 is not valid"),
    "a seed with a fraction": (
        HEAD + "seeds = [1.5]\n" + BODY,
        "seeds.0 = 1.5 is not valid: input should be a valid int",
    ),
    "tolerance": (GOOD + "[score]\nwithin = 0\n", "score.within = 0 is not valid: input should be greater than 0"),
    "no time": (GOOD + "[limits]\nseconds = 0\n", "limits.seconds = 0 is not valid: input should be greater than 0"),
    "half a step": (
        GOOD + "[limits]\nsteps = 10.5\n",
        "limits.steps = 10.5 is not valid: input should be a valid integer",
    ),
    "profile": (
        GOOD + '[localise]\nprofile = "worst"\n',
        "profile 'worst' is unknown; valid are thesis, counting, best",
    ),
    "method": (
        GOOD + '[localise]\nmethods = ["magic"]\n',
        "localise: method 'magic' is unknown; valid are thesis/uniform",
    ),
    "own localiser that is not there": (
        GOOD + '[localise]\njudged = "no.where:Mine"\n',
        "localise: localiser 'no.where:Mine': there is no module 'no.where'; valid is package.module:Class",
    ),
    "judged that does not run": (
        GOOD + '[localise]\nmethods = ["vlad"]\n',
        "expect: 'success_hmm >= 80 % over 2 seeds': 'thesis/chain' does not run here; valid are vlad",
    ),
    "compared with itself by who is judged": (
        'title = "T"\nexpect = ["success >= success of best/chain"]\n' + BODY + '[localise]\njudged = "best/chain"\n',
        "expect: 'success >= success of best/chain': compares success with itself, as best/chain is judged; valid are",
    ),
    "compared with itself by its stage": (
        'title = "T"\nexpect = ["failures_hmm <= 50 % of failures"]\n' + BODY,
        "expect: 'failures_hmm <= 50 % of failures': compares failures with itself, as thesis/chain is judged",
    ),
    "nobody judged": (
        HEAD + BODY + '[localise]\nmethods = ["vlad", "ransac"]\n',
        "localise.judged: missing, and its default 'thesis/chain' does not run here; valid are vlad, ransac",
    ),
    "feature": (
        GOOD + '[localise]\nlearn.features = ["walls", "smell"]\n',
        "localise.learn.features.1: 'smell' is not valid; it should be one of sift, neural, dense, walls, doors",
    ),
    "no feature": (
        GOOD + "[localise]\nlearn.features = []\n",
        "localise.learn.features holds too little; it should be a list of 1 or more",
    ),
    "an unknown key of a table in a table": (
        GOOD + "[localise.learn]\nword = 1.0\n",
        "localise.learn.word: is not known here; valid are features, words, alike",
    ),
    "no words": (GOOD + "[localise]\nlearn.words = 0\n", "localise.learn.words = 0 is not valid"),
    "words in per cent": (GOOD + "[localise]\nlearn.words = 50\n", "localise.learn.words = 50 is not valid"),
    "places that are too alike": (
        GOOD + "[localise]\nlearn.alike = 1.5\n",
        "localise.learn.alike = 1.5 is not valid",
    ),
    "places": (GOOD + '[localise]\nplaces = "3-9"\n', "localise.places = '3-9' is not valid: string should match"),
    "places that hold nothing": (
        GOOD + '[localise]\nplaces = "9:3"\n',
        "localise.places: '9:3' holds nothing; valid is FROM:TO, FROM below TO",
    ),
    "no place": (GOOD + '[localise]\nplaces = ":0"\n', "localise.places: ':0' holds nothing; valid is FROM:TO"),
    "places in other digits": (GOOD + '[localise]\nplaces = "٣:٩"\n', "localise.places = '٣:٩' is not valid: string"),
    "a file that no system has": (
        GOOD + 'world = "a\\u0000.toml"\n',
        "query.world: 'a\\x00.toml' is not valid; it should be one line of characters that can be printed",
    ),
    "a camera's table that no system has": (
        GOOD + '[query.cameras]\ncamera-1 = "a\\u0000.toml"\n',
        "query.cameras.camera-1: 'a\\x00.toml' is not valid; it should be one line of characters",
    ),
    "an empty title": ('title = " "\n' + BODY, "title: ' ' is not valid; it should be a line of words"),
    "more seeds than the one": (
        HEAD + 'seeds = [1]\nexpect = ["success >= 0.5 over 2 seeds"]\n' + BODY,
        "expect: 'success >= 0.5 over 2 seeds': the scenario has 1 seed; valid is 'over' so many at most",
    ),
    "a title in two lines": ('title = "a\\nb"\n' + BODY, "title: 'a\\nb' is not valid; it should be one line of"),
    "no view": (GOOD + "[query.trigger]\ndistance = 0\n", "query: trigger: distance, turn and time are all off; valid"),
    "grammar": (HEAD + 'expect = ["it works"]\n' + BODY, "'it works' is no expectation; valid is FIGURE"),
    "figure": (HEAD + 'expect = ["luck >= 1"]\n' + BODY, "'luck >= 1': figure 'luck' is unknown; valid are success"),
    "expectation's method": (
        HEAD + 'expect = ["success of vlad >= 0.5"]\n' + BODY,
        "expect: 'success of vlad >= 0.5': 'vlad' does not run here; valid are thesis/uniform, thesis/prior, thesis/c",
    ),
    "more seeds than there are": (
        HEAD + 'expect = ["success >= 0.5 over 9 seeds"]\n' + BODY,
        "expect: 'success >= 0.5 over 9 seeds': the scenario has 5 seeds; valid is 'over' so many at most",
    ),
    "vary's kind": (
        GOOD + "[vary.all]\nx = 1\n",
        "vary: all is not valid; it should be one of grid, list, random, or list and grid",
    ),
    "two kinds": (GOOD + '[vary.grid]\n"seeds" = [[1]]\n[vary.random]\ncount = 1\n', "vary: grid, random is not valid"),
    "a key in both kinds": (
        GOOD + '[[vary.list]]\n"query.light" = "noon"\n[vary.grid]\n"query.light" = ["18:00"]\n',
        "vary: key 'query.light' is in list and grid; valid is one of them",
    ),
    "vary's key": (GOOD + '[vary.grid]\n"query.lihgt" = ["noon"]\n', "query.lihgt: is not known here; valid are world"),
    "key through no table": (
        GOOD + '[vary.grid]\n"title.x" = [1]\n',
        "vary: key 'title.x' leads through 'title'; valid",
    ),
    "varied light": (
        GOOD + '[vary.grid]\n"query.light" = ["noon", "dusk"]\n',
        "query: unknown light 'dusk'; known are morning",
    ),
    "varied fault": (
        GOOD + '[[query.faults]]\nkind = "kidnap"\nat = 1\nto = 15\n[vary.grid]\n"query.end" = [20.0, 10.0]\n',
        "query: fault kidnap: to = 15 m is beyond the end of what is driven; valid is 0 to 10.0 m",
    ),
    "empty grid": (GOOD + "[vary.grid]\n", "vary.grid: names no key; valid is a list of values for each key"),
    "grid of no list": (GOOD + '[vary.grid]\n"query.light" = "noon"\n', "vary.grid.query.light = 'noon' is not valid"),
    "grid of an empty list": (GOOD + '[vary.grid]\n"query.light" = []\n', "vary.grid.query.light = [] is not valid"),
    "grid of too many": (
        GOOD + "".join(["[vary.grid]\n", *(f'"a{k}" = [1, 2, 3, 4]\n' for k in range(20))]),
        "vary.grid makes more than 1000 cases; valid are 1 to 1000",
    ),
    "list of no case": (
        GOOD.replace("title", "vary = {list = []}\ntitle"),
        "vary.list makes no cases; valid are 1 to 1000",
    ),
    "colliding names": (
        GOOD + '[[vary.list]]\nname = "a"\n[[vary.list]]\nname = "a"\n',
        "vary.list: 2 cases are called 'a'; valid are names that differ",
    ),
    "values alike": (
        GOOD + '[vary.grid]\n"query.start" = [1.0, 1.0]\n',
        "vary.grid: 2 cases are called '1.0'; valid are",
    ),
    "a name in two lines": (
        GOOD + '[[vary.list]]\nname = "a\\nb"\n',
        "vary.list: a case is called 'a\\nb'; valid is a n",
    ),
    "no name": (GOOD + '[[vary.list]]\nname = ""\n', "vary.list: a case is called ''; valid is a name in one line"),
    "a number for a name": (
        GOOD + "[[vary.list]]\nname = 3\n",
        "vary.list: name = 3 is not valid; it should be a text",
    ),
    "random without a count": (
        GOOD + "[vary.random]\nseed = 1\n",
        "vary.random.count = None is not valid; it should be",
    ),
    "random without a key": (GOOD + "[vary.random]\ncount = 2\nseed = 1\n", "vary.random: names no key; valid is"),
    "random hours backwards": (
        GOOD + '[vary.random]\ncount = 2\nseed = 1\n"query.light" = {from = "20:00", to = "08:00"}\n',
        "vary.random.query.light = {'from': '20:00', 'to': '08:00'} is not valid; it should be {from, to}, rising",
    ),
    "random to infinity": (
        GOOD + '[vary.random]\ncount = 2\nseed = 1\n"query.start" = {from = 0, to = inf}\n',
        "vary.random.query.start = {'from': 0, 'to': inf} is not valid; it should be {from, to}, rising",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, what: str) -> None:
    text, told = BAD[what]
    path = written(tmp_path, text)
    with pytest.raises(ScenarioError) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: {told}")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        ScenarioError, match=r"no\.toml: cannot be read: No such file or directory; valid is a scenario"
    ):
        load(tmp_path / "no.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ScenarioError, match=r"folder\.toml: cannot be read: is no file; valid is a scenario"):
        load(tmp_path / "folder.toml")


@pytest.mark.parametrize("name", ["magic", "smoke/magic", "", "/", "smoke/"])
def test_a_name_that_is_none_is_told_with_those_that_are(name: str) -> None:
    with pytest.raises(ScenarioError, match=r"is unknown; valid are .*smoke"):
        find([name])


def test_cases_that_nobody_could_tell_apart_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "other").mkdir()
    one, other = written(tmp_path, GOOD), written(tmp_path / "other", GOOD)
    with pytest.raises(ScenarioError) as caught:
        find([str(one), str(other)])
    assert str(caught.value) == f"{one} and {other}: both make a case 'mine'; valid are names that differ"
    monkeypatch.chdir(tmp_path)
    assert [case.name for case in find([str(one), "mine.toml", "other/../mine.toml"])] == ["mine"]


# --- whatever is written ---


def toml(value: Any) -> str:
    """A value as TOML has it inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{toml(key)} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(one) for one in value) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    # Delete is the one character that JSON leaves as it is and TOML does not allow.
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


WHOLE: dict[str, Any] = {
    "title": "T",
    "tags": ["a"],
    "seeds": [1, 2],
    "expect": ["success_hmm >= 80 %", "to_lost <= 5 m"],
    "reference": {"world": "annex", "renderer": "none", "trigger": {"distance": 0.5}, "faults": []},
    "query": {
        "light": "18:00",
        "start": 1.0,
        "end": 9.0,
        "waypoints": [],
        "cameras": {"camera-1": "fire-i"},
        "faults": [{"kind": "kidnap", "at": 1.0, "to": 2.0}, {"kind": "wheel-slip", "at": 1, "seconds": 2}],
    },
    "localise": {"profile": "thesis", "methods": ["thesis", "vlad"], "sensors": ["laser"], "places": "1:9"},
    "score": {"within": 1.5},
    "limits": {"steps": 100, "seconds": 9.0},
    "vary": {"grid": {"query.light": ["noon", "18:00"]}},
}


def paths(table: Any, at: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Where all values are."""
    inside = (
        list(table.items()) if isinstance(table, dict) else list(enumerate(table)) if isinstance(table, list) else []
    )
    return [found for key, one in inside for found in [(*at, key), *paths(one, (*at, key))]]


TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
SCALARS = st.none() | st.booleans() | st.integers(-(2**40), 2**40) | st.floats() | TEXTS
WORDS = st.sampled_from(
    ["annex", "none", "18:00", "25:61", "thesis", "laser", "1:2", "kidnap", "success >= 1", "x:Y", "a.b"]
)
VALUES = st.recursive(
    SCALARS.filter(lambda value: value is not None) | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS | WORDS, inner, max_size=3),
    max_leaves=5,
)


@st.composite
def spoilt(draw: st.DrawFn) -> dict[str, Any]:
    """The whole table with some values changed, taken away, or put in beside."""
    table = deepcopy(WHOLE)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(paths(table)))
        inner: Any = table
        for key in path[:-1]:
            inner = inner[key]
        match draw(st.sampled_from(["change", "remove", "add"])):
            case "change":
                inner[path[-1]] = draw(VALUES)
            case "remove":
                del inner[path[-1]]
            case "add" if isinstance(inner, dict):
                inner[draw(TEXTS | WORDS)] = draw(VALUES)
        if not table:
            break
    return table


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(spoilt())
def test_any_table_makes_cases_or_one_line(tmp_path: Path, table: dict[str, Any]) -> None:
    text = "\n".join(f"{toml(key)} = {toml(value)}" for key, value in table.items())
    path = written(tmp_path, text)
    try:
        cases = load(path)
    except ScenarioError as error:
        message = str(error)
    else:
        message = f"{path}: " + ", ".join(case.name for case in cases)
    assert message.startswith(f"{path}: ")
    assert len(message.splitlines()) == 1
    assert "is no TOML" not in message


def test_the_whole_table_is_good(tmp_path: Path) -> None:
    path = written(tmp_path, "\n".join(f"{key} = {toml(value)}" for key, value in WHOLE.items()))
    assert [case.name for case in load(path)] == ["mine/noon", "mine/18:00"]


# --- what a file means ---


def test_a_query_is_as_the_reference_but_for_what_it_says(tmp_path: Path) -> None:
    case = only_case(
        tmp_path, GOOD.replace("[query]", '[[reference.faults]]\nkind = "kidnap"\nat = 1\nto = 2\n[query]')
    )
    reference, query = case.sources(7)
    assert isinstance(reference, Drive)
    assert isinstance(query, Drive)
    assert (reference.seed, query.seed) == (7, 7 + QUERY_SEEDS)
    assert (reference.light, query.light) == ("16:00", "18:00")
    assert (reference.end, query.end) == (20.0, 20.0)
    assert (len(reference.faults), len(query.faults)) == (1, 0)


def test_each_key_of_a_drive_is_what_is_driven(tmp_path: Path) -> None:
    text = """title = "T"
[reference]
world = "annex"
robot = "robuter"
light = "18:00"
change = "few"
change_seed = 3
start = 1
end = 9
world_seed = 2
renderer = "classic"
trigger = { distance = 0.5, turn = 90, time = 2 }
cameras = { camera-1 = "fire-i-wide" }
laser_range = 8
operator = 0.5
faults = [{ kind = "camera-black", at = 2, until = 3, camera = "camera-2" }]
[query]
waypoints = [[1, 0], [4, 0]]
[limits]
steps = 100
"""
    with pytest.raises(ScenarioError, match="no stretch"):  # the query's waypoints are shorter than the reference's end
        only_case(tmp_path, text)
    reference, query = only_case(tmp_path, text.replace("[query]", "[query]\nstart = 0\nend = 3")).sources(7)
    assert reference == Drive(
        world="annex",
        robot="robuter",
        light="18:00",
        change="few",
        change_seed=3,
        seed=7,
        world_seed=2,
        renderer=RendererKind.CLASSIC,
        trigger=Trigger(0.5, math.pi / 2, 2.0),
        style=OperatorStyle(strength=0.5),
        cameras={"camera-1": "fire-i-wide"},
        laser=RangeMode.METRES_8,
        start=1.0,
        end=9.0,
        faults=(CameraBlack(2.0, 3.0, "camera-2"),),
        patience=4.0,
    )
    assert isinstance(query, Drive)
    assert (query.waypoints, query.start, query.end, query.faults) == (((1.0, 0.0), (4.0, 0.0)), 0.0, 3.0, ())
    assert (query.trigger, query.patience, query.change) == (reference.trigger, 4.0, "few")


def test_who_runs_alone_is_judged(tmp_path: Path) -> None:
    assert only_case(tmp_path, HEAD + BODY + '[localise]\nmethods = ["vlad"]\n').scenario.judged == "vlad"
    assert only_case(tmp_path, HEAD + BODY).scenario.judged == "thesis/chain"


def test_noise_on_a_log_s_odometry_differs_from_seed_to_seed_where_it_is_asked_for(tmp_path: Path) -> None:
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\nodometry_noise = true\n[query]\nviews = "3:9"\n')
    assert case.sources(7) == (Log("a.log", None, 0.0, 7), Log("a.log", "3:9", 0.0, 7 + QUERY_SEEDS))
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\n[query]\n')
    assert case.sources(7) == (Log("a.log"), Log("a.log"))


@pytest.mark.parametrize(
    ("sides", "seeds"),
    [
        ('[reference]\nlog = "a.log"\n[query]\n', 1),
        ('[reference]\nimages = "a"\n[query]\nimages = "b"\n', 1),
        ('[reference]\nlog = "a.log"\n[query]\nodometry_noise = true\n', 5),
        ('[reference]\nlog = "a.log"\n[[further]]\nodometry_noise = true\n[query]\n', 5),
        (f'{REFERENCE}[query]\nlog = "a.log"\n', 5),
    ],
)
def test_where_nothing_is_drawn_there_is_one_seed(tmp_path: Path, sides: str, seeds: int) -> None:
    assert len(only_case(tmp_path, HEAD + sides).scenario.seeds) == seeds


TURNED = """index,x,y,theta
0,5,5,1.5707963
2,5,7,1.5707963
"""


def line_of_scans(folder: Path) -> None:
    """A log of three scans whose odometry leads along the x axis, a metre each."""
    scan = "FLASER 3 1.0 1.0 1.0 {0} 0 0 {0} 0 0 {0} host {0}\n"
    (folder / "a.log").write_text("".join(scan.format(number) for number in range(3)))


def test_the_truth_of_a_log_may_stand_in_a_file_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path))
    line_of_scans(tmp_path)
    (tmp_path / "t.csv").write_text(TURNED)
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\ntruth = "t.csv"\n[query]\nviews = "1:"\n')
    reference, query = case.sources(1)
    assert (reference, query) == (Log("a.log", truth="t.csv"), Log("a.log", "1:", truth="t.csv"))
    views = read_real(query).views
    assert [view.truth.y for view in views if view.truth] == pytest.approx([6, 7])  # between the file's two, and there
    assert views[1].distance == pytest.approx(1.0)  # the odometry is the log's own


@pytest.mark.parametrize(
    ("content", "told"), [("index,x,y,theta\n7,5,5,0\n9,5,7,0\n", "t.csv"), ("rubbish\n", "t.csv"), ("", "t.csv")]
)
def test_a_truth_that_does_not_fit_its_log_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str, told: str
) -> None:
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path))
    line_of_scans(tmp_path)
    (tmp_path / "t.csv").write_text(content)
    with pytest.raises(LogError, match=told) as error:
        read_real(Log("a.log", truth="t.csv"))
    assert len(str(error.value).splitlines()) == 1


def test_a_truth_that_is_missing_is_absent_as_a_log_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path))
    line_of_scans(tmp_path)
    with pytest.raises(AbsentError, match=r"t\.csv"):
        read_real(Log("a.log", truth="t.csv"))


@pytest.mark.parametrize("named", ["a.log", "folder/../a.log", "{absolute}"])
def test_a_log_of_one_s_own_lies_beside_its_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    monkeypatch.delenv("REFSEQ_RECORDINGS", raising=False)
    (tmp_path / "folder").mkdir()
    line_of_scans(tmp_path)
    (tmp_path / "t.csv").write_text(TURNED)
    file = named.format(absolute=tmp_path / "a.log")
    reference, _ = only_case(tmp_path, HEAD + f'[reference]\nlog = "{file}"\ntruth = "t.csv"\n[query]\n').sources(1)
    assert isinstance(reference, Log)
    assert len(read_real(reference).views) == 3
    (tmp_path / "a.log").unlink()
    with pytest.raises(AbsentError) as caught:
        read_real(reference)
    assert str(caught.value) == (
        f"{file}: is not there; valid is a recording that is"
        if file.startswith("/")
        else f"{file}: is not in {tmp_path}; valid is one beside the scenario, or in the folder that REFSEQ_RECORDINGS "
        "names, now none"
    )


@given(st.text("a/.", min_size=1, max_size=12))
def test_no_name_leads_out_of_the_folder_that_another_machine_is_sent(name: str) -> None:
    assert Path("/sent") in (Path("/sent") / place_below(name) / "x").resolve().parents


def test_a_query_of_another_kind_takes_over_nothing(tmp_path: Path) -> None:
    case = only_case(tmp_path, HEAD + REFERENCE + '[query]\nlog = "a.log"\n')
    assert case.sources(1)[1] == Log("a.log")
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\nthin = 2\n[query]\nimages = "b"\n')
    assert case.sources(1) == (Log("a.log", None, 2.0), Images("b"))
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\nthin = 2\n[query]\nviews = "3:9"\n')
    assert case.sources(1)[1] == Log("a.log", "3:9", 2.0)


def test_a_log_that_is_missing_is_no_mistake_but_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = only_case(tmp_path, HEAD + '[reference]\nlog = "a.log"\n[query]\n')
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path))
    (first, *_), *_ = answer_tasks(case).values()
    with pytest.raises(AbsentError, match=r"a\.log"):
        _ = first.key


def test_a_plan_beside_the_file_is_read_again_when_it_was_changed(tmp_path: Path) -> None:
    plan = (Path(__file__).parents[4] / "scenarios/library/identical-doors.toml").read_text()
    (tmp_path / "plan.toml").write_text(plan)
    case = only_case(tmp_path, HEAD + '[reference]\nworld = "plan.toml"\nrenderer = "none"\n[query]\n')
    drive = case.sources(1)[0]
    assert isinstance(drive, Drive)
    assert drive.world == str(tmp_path / "plan.toml")
    assert check_route(drive) > 20
    (tmp_path / "plan.toml").write_text("title = 3")
    with pytest.raises(Exception, match=r"plan\.toml"):
        check_route(drive)


def test_numbers_that_are_whole_are_lengths_too(tmp_path: Path) -> None:
    case = only_case(tmp_path, GOOD.replace("end = 20.0", "end = 20"))
    assert isinstance(case.scenario, Scenario)
    drive = case.sources(1)[0]
    assert isinstance(drive, Drive)
    assert check_route(drive) == pytest.approx(20)


def test_the_page_tells_all_that_can_be_expected_and_its_example_is_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[4] / "docs/scenarios.md").read_text()
    section = page.split("## Scenario files")[1].split("\n## ")[0]
    example = section.split("```toml\n")[1].split("```")[0]
    assert [case.name for case in load(written(tmp_path, example))] == ["mine/noon", "mine/18:00"]
    assert [name for name in FIGURES if f"`{name}`" not in section] == []


def test_signal_faults_are_part_of_the_key_of_answers_and_of_nothing_else(tmp_path: Path) -> None:
    ill = only_case(tmp_path, with_signal('kind = "laser-mirrored", at = 2.0'))
    later = only_case(tmp_path, with_signal('kind = "laser-mirrored", at = 3.0'))
    healthy = only_case(tmp_path, GOOD)
    tasks = [answer_tasks(case)[1][0] for case in (healthy, ill, later)]
    assert len({task.key for task in tasks}) == 3
    assert len({(task.maps, task.sources) for task in tasks}) == 1
    assert tasks[1].signal_faults == (SignalFault(SignalFaultKind.LASER_MIRRORED, at=2.0),)
