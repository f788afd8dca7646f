"""``refseq mission plan | run``, as a user meets them: in the offices, by the laser alone."""

from pathlib import Path

import pytest

from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.profile import BEST
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import same, values, verified
from tests.scenarios.conftest import Refseq

BY_LASER = Drive(world="offices", renderer=RendererKind.NONE, behaviours=("MN:14",))


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A way past the first two doors, learnt by the laser; and an atlas in which it is one of two."""
    folder = tmp_path_factory.mktemp("maps")
    drive = record(BY_LASER, folder / "offices.mcap")
    sequence = learn(drive.views, profile=BEST, metadata=drive.metadata)
    sequence.save(folder / "offices.refseq")
    beside(named_maps(["east", "again"], [sequence, sequence])).save(folder / "atlas.refseq")
    return folder


@pytest.fixture
def here(maps: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(maps)
    return maps


def test_a_plan_tells_doors_and_orders(refseq: Refseq, here: Path) -> None:
    answer = refseq("mission", "plan", "offices.refseq", "[LD_LDMC]")
    assert (answer.code, answer.err) == (0, "")
    lines = answer.out.splitlines()
    assert lines[0].startswith("door 1:    4.7 m, on the left")
    assert lines[0].endswith("closed, or something stands in it")
    assert lines[1].startswith("door 2:   10.5 m, on the left")
    assert lines[1].endswith("open")
    assert "[LD_LDMC]: 3 orders over 9.3 m" in lines
    assert [line.split()[2] for line in lines[-3:]] == ["MN:14", "MN:14", "MC:left"]


@pytest.mark.quick_cases("to the second door")
@pytest.mark.parametrize(
    ("mission", "last"), [("[LD_LD]", "MN:14"), ("[LD_LDMC]", "MC:left")], ids=["to the second door", "through it"]
)
def test_a_mission_is_run_told_and_left_in_a_folder(
    refseq: Refseq, here: Path, tmp_path: Path, mission: str, last: str
) -> None:
    answer = refseq("mission", "run", "offices.refseq", mission, "-o", str(tmp_path / "out"))
    assert (answer.code, answer.err) == (0, "")
    assert "passes LD: door on the left, 4.7 m" in answer.out
    assert "the mission is completed" in answer.out
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["log.txt", "mission.rrd", "plan.svg"]
    log = (tmp_path / "out" / "log.txt").read_text()
    assert log.splitlines() == [line for line in answer.out.splitlines() if " m  " in line]
    assert last in (tmp_path / "out" / "plan.svg").read_text()
    record = tmp_path / "out" / "mission.rrd"
    assert verified(record)
    assert [line for (line,) in values(record, "/mission/log", "TextLog:text", "time")] == log.splitlines()
    lost = values(record, "/mission/lost", "Scalars:scalars", "view")
    assert len(lost) > 10
    # The last ones are of the crossing itself, where it leaves the path.
    assert max(value for (value,) in lost[:-2]) < 0.5


OFFICES = Path(__file__).parents[3] / "worlds" / "library" / "offices.toml"
TROLLEY = """
[[furniture]]
name = "trolley"
kind = "table"
at = [6.0, 0.1]
heading = 90
width = 1.6
depth = 0.6
height = 0.95
material = "metal"
"""


def test_what_the_robot_touches_is_told_and_left_in_the_folder(refseq: Refseq, here: Path, tmp_path: Path) -> None:
    """The trolley's top is above the laser and the sonar."""
    world, out = tmp_path / "way.toml", tmp_path / "out"
    world.write_text(OFFICES.read_text() + TROLLEY)
    answer = refseq("mission", "run", "offices.refseq", "[LD]", "--by-odometry", "--world", str(world), "-o", str(out))
    assert (answer.code, answer.err) == (0, "the robot touched table:trolley:0\n")
    log = (out / "log.txt").read_text()
    (line,) = [line for line in log.splitlines() if "touches table:trolley:0" in line]
    assert line in answer.out
    assert "touches table:trolley:0" in (out / "plan.svg").read_text()
    assert line in [text for (text,) in values(out / "mission.rrd", "/mission/log", "TextLog:text", "time")]


def test_a_mission_s_folder_is_viewed_as_it_was_recorded(refseq: Refseq, here: Path, tmp_path: Path) -> None:
    run = refseq("mission", "run", "offices.refseq", "[LD]", "--by-odometry", "-o", str(tmp_path / "out"))
    assert run.code == 0
    record, copy = tmp_path / "out" / "mission.rrd", tmp_path / "copy.rrd"
    for asked in (tmp_path / "out", record):
        assert refseq("view", str(asked), "-o", str(copy)).code == 0
        assert same(record, copy)
    answer = refseq("view", str(tmp_path / "out"), "--thin", "2", "-o", str(copy))
    assert answer.code == 2
    assert "is shown as it is; valid is without --reference, --views and --thin" in answer.err
    record.write_bytes(b"no recording")
    for asked, told in ((record, "mission.rrd: cannot be read: "), (here, "holds nothing to show; valid is a folder ")):
        answer = refseq("view", str(asked), "-o", str(tmp_path / "other.rrd"))
        assert answer.code == 2
        assert told in answer.err
        assert len(answer.err.splitlines()) == 1
    assert not (tmp_path / "other.rrd").exists()


@pytest.mark.slow
def test_who_is_not_told_where_he_begins_fails_by_the_odometer_alone(refseq: Refseq, here: Path) -> None:
    """He takes the third door for the second one, and that is not open."""
    answer = refseq("mission", "run", "offices.refseq", "[LD_LDMC]", "--by-odometry", "--start", "7")
    assert answer.code == 1
    assert answer.err.startswith("not completed: failed: MC:left failed: ")


def test_in_an_atlas_one_says_where_to(refseq: Refseq, here: Path) -> None:
    answer = refseq("mission", "plan", "atlas.refseq", "--from", "again:2", "--to", "again:9")
    assert answer.code == 0
    sequence = Map.load(here / "offices.refseq")
    length = sequence.paths[0].along[9] - sequence.paths[0].along[2]
    assert f"learnt: 1 order over {length:.1f} m" in answer.out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("plan", "offices.refseq", "[LD_LA3]"), "mission [LD_LA3], step 2: nobody has said where LA3 is; "),
        (("plan", "offices.refseq", "[LD_LX]"), "mission '[LD_LX]', column 5: "),
        (("plan", "offices.refseq", "[LD_LD_LD_LD]"), "mission [LD_LD_LD_LD], step "),
        (
            ("plan", "offices.refseq", "[LA3]", "--landmark", "LA3=far"),
            "mission [LA3], step 1: LA3 is at 'far'; valid ",
        ),
        (("plan", "offices.refseq", "--landmark", "LA3=2"), "--landmark goes with a mission of landmarks; "),
        (("plan", "atlas.refseq"), "nobody says where to; valid is --to PATH:VIEW, a view of east, again"),
        (("plan", "atlas.refseq", "--to", "west:3"), "place 'west:3': path 'west' is unknown; valid are east, again"),
        (("plan", "none.refseq"), "none.refseq: "),
        (("run", "offices.refseq", "--start", "99"), "start 99 m is not on the way; valid is 0 to 14.0 m"),
        (
            ("run", "offices.refseq", "--renderer", "oil"),
            "--renderer 'oil' is not valid; valid are baked, filament, classic, none",
        ),
        (("run", "offices.refseq", "--start", "99", "-o", "new/out"), "start 99 m is not on the way"),
        (
            ("run", "offices.refseq", "-o", "offices.mcap/out"),
            "offices.mcap/out: offices.mcap is no folder; valid is the name of a folder",
        ),
        (
            ("run", "offices.refseq", "--filmstrip", "5"),
            "--filmstrip is left in a folder; valid is to name one as well",
        ),
        (("run", "offices.refseq", "--world", "moon"), "unknown world 'moon'"),
        (("run", "offices.refseq", "--light", "dusky"), "unknown light 'dusky'"),
    ],
)
def test_bad_input_is_one_line_and_code_2(refseq: Refseq, here: Path, words: tuple[str, ...], told: str) -> None:
    before = sorted(here.iterdir())
    answer = refseq("mission", *words)
    assert answer.code == 2
    assert answer.err.count("\n") <= 1
    assert told in answer.err
    assert sorted(here.iterdir()) == before
