"""``refseq localise`` and ``refseq report`` with an atlas: its places, and which of its paths is recognised."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from refseq.atlas.merge import merge_maps
from refseq.belief import LOST_ABOVE, Stage
from refseq.errors import MapError
from refseq.logs import RecordingWriter, read_recording
from refseq.logs.beliefs import read_beliefs, read_localised_views
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise
from refseq.map.map import Map, beside
from refseq.map.profile import BEST
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.drives.evaluate import compare, places_as_views
from refseq_bench.scenarios.scoring.comparison import Drives
from refseq_bench.scenarios.scoring.tables.sequence_recall import answers_by_path, sequence_recall_table
from tests.refseq.rooms import named_maps
from tests.scenarios.conftest import Refseq
from tests.support import certain, corridor_drive

SHARED = slice(10, 22)
QUERY = 12
"""Views of the query, all of them beyond those that both drives share."""


def write(path: Path, views: Sequence[View]) -> None:
    with RecordingWriter(path, {"light": "18:00"}) as writer:
        for view in views:
            writer.write(view, Pose(0, 0, 0))


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Maps of the two halves of a drive, which share 12 views, an atlas of them, later drives through the second."""
    folder = tmp_path_factory.mktemp("desk")
    drive = corridor_drive(np.random.default_rng(1), count=36, size=96)
    west = learn(drive[: SHARED.stop], profile=BEST, metadata={"world": "hallway", "route": "west"})
    east = learn(drive[SHARED.start :], profile=BEST, metadata={"world": "hallway", "route": "east"})
    west.save(folder / "west.refseq")
    east.save(folder / "east.refseq")
    merge_maps(named_maps(["west", "east"], [west, east])).map.save(folder / "atlas.refseq")
    query = corridor_drive(np.random.default_rng(2), count=36, size=96, brightness=0.8)
    write(folder / "query.mcap", query[-QUERY:])
    write(folder / "blind.mcap", [replace(view, images={}) for view in query[-QUERY:]])
    atlas = (folder / "atlas.refseq").read_bytes()
    middle = len(atlas) // 2
    (folder / "spoilt.refseq").write_bytes(atlas[:middle] + bytes([atlas[middle] ^ 255]) + atlas[middle + 1 :])
    (folder / "cut.refseq").write_bytes(atlas[:middle])
    return folder


@pytest.fixture
def here(desk: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(desk)
    return desk


def row(text: str, name: str) -> list[int]:
    """The numbers of one line of a table."""
    (line,) = [line for line in text.splitlines() if line.strip().startswith(name)]
    return [int(number) for number in re.findall(r"\d+", line.strip().removeprefix(name))]


def test_a_drive_is_localised_in_an_atlas(refseq: Refseq, here: Path) -> None:
    words = "localise atlas.refseq query.mcap --stage uniform --stage chain -o beliefs.parquet"
    answer = refseq(*words.split())
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.startswith(f"beliefs.parquet: beliefs of {QUERY} views\natlas.refseq ← query.mcap: {QUERY} views")
    atlas, beliefs = Map.load(here / "atlas.refseq"), read_beliefs(here / "beliefs.parquet")
    assert list(beliefs) == [Stage.UNIFORM, Stage.CHAIN]
    for stage in beliefs:
        assert [len(belief.places) for belief in beliefs[stage]] == [len(atlas)] * QUERY
    # Only the second drive was ever there: it holds these places, and no other path runs through them.
    lost = [sum(belief.lost > LOST_ABOVE for belief in answers) for answers in beliefs.values()]
    assert max(lost) <= 1
    east = [count for n in lost for count in (QUERY - n, QUERY - n)]
    assert row(answer.out, "west") == [len(atlas.sequences[0]), 0, 0, 0, 0]
    assert row(answer.out, "east") == [len(atlas.sequences[1]), *east]
    assert row(answer.out, "says lost") == lost


@pytest.mark.parametrize("world", ["hallway", "annex"])
def test_a_drive_of_another_world_than_the_map_s_is_noted(refseq: Refseq, here: Path, world: str) -> None:
    with RecordingWriter(here / "of-world.mcap", {"world": world}) as writer:
        for view in corridor_drive(np.random.default_rng(2), count=6, size=96):
            writer.write(view, Pose(0, 0, 0))
    answer = refseq("localise", "atlas.refseq", "of-world.mcap", "--stage", "uniform")
    told = (
        "note: annex is the drive's world, and hallway the map's: true poses of two worlds are compared, and right or "
        "wrong tell little\n"
    )
    assert (answer.code, answer.err) == (0, "" if world == "hallway" else told)


@pytest.mark.parametrize(("true", "told"), [(True, {"times": "by the pictures' names"}), (False, {})])
def test_worlds_are_not_compared_without_true_poses_or_by_the_names_of_folders(
    refseq: Refseq, here: Path, true: bool, told: dict[str, str]
) -> None:
    with RecordingWriter(here / "of-world.mcap", {"world": "annex", **told}) as writer:
        for view in corridor_drive(np.random.default_rng(2), count=6, size=96):
            writer.write(view if true else replace(view, truth=None), Pose(0, 0, 0))
    answer = refseq("localise", "atlas.refseq", "of-world.mcap", "--stage", "uniform")
    assert (answer.code, answer.err) == (0, "")


@pytest.mark.quick_cases("1.3")
@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_an_odometer_whose_metres_are_others_than_the_map_s_is_told(refseq: Refseq, here: Path, scale: float) -> None:
    """On the terminal, to other programs, view by view in the table of beliefs, and on the page of a report."""
    learn(corridor_drive(np.random.default_rng(1), count=36, size=96), profile=BEST).save(here / "whole.refseq")
    with RecordingWriter(here / "scaled.mcap", {}) as writer:
        for k, view in enumerate(corridor_drive(np.random.default_rng(2), count=36, size=96)):
            writer.write(replace(view, scan=None), Pose(scale * 0.85 * k, 0, 0))
    words = "localise whole.refseq scaled.mcap --stage prior --stage chain -o scaled.parquet"
    answer = refseq(*words.split())
    assert (answer.code, answer.err) == (0, "")
    told = re.findall(
        r"^(.*): one metre of the drive's odometer is taken for ([0-9.]+) m of the map: one of the two",
        answer.out,
        re.M,
    )
    prior, chain = (one.get("odometer_scale") for one in json.loads(refseq(*words.split(), "--json").out)["stages"])
    assert told == ([] if scale == 1 else [("chain", f"{chain:.2f}")])
    assert (prior, scale * chain) == (None, pytest.approx(1.0, abs=0.04))
    beliefs = read_beliefs(here / "scaled.parquet")[Stage.CHAIN]
    assert (beliefs[0].odometer_scale, round(beliefs[-1].odometer_scale, 4)) == (1.0, chain)
    assert refseq("report", "whole.refseq", "scaled.mcap", "scaled.parquet", "-o", "page.html").code == 0
    page = (here / "page.html").read_text(encoding="utf-8")
    assert page.count(f"odometer is taken for {chain:.2f} m of the map") == (scale != 1)


def test_below_what_is_asked_is_exit_code_1_after_all_was_told(refseq: Refseq, here: Path) -> None:
    answer = refseq("localise", "atlas.refseq", "query.mcap", "--stage", "uniform", "--at-least", "90")
    assert (answer.code, answer.err) == (0, "")
    views = read_recording(here / "query.mcap").views
    write(here / "moved.mcap", [replace(view, truth=Pose(5.0, 0.0, 0.0)) for view in views])
    answer = refseq("localise", "atlas.refseq", "moved.mcap", "--stage", "uniform", "--at-least", "90")
    assert answer.code == 1
    assert "says lost" in answer.out
    assert answer.err.startswith("below what was asked: 0.0 %")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            "localise atlas.refseq query.mcap --sensors sonar",
            "atlas.refseq: sensor 'sonar' is not in the map; valid are forward, laser",
        ),
        (
            "localise atlas.refseq blind.mcap --sensors forward",
            "atlas.refseq ← blind.mcap: the drive's sensors (laser) have none in common with the map's; valid are forw",
        ),
        ("localise atlas.refseq query.mcap --stage magic", "stage 'magic' is unknown; valid are uniform, prior, chain"),
        ("localise query.mcap query.mcap", "query.mcap: is a log (a Foxglove MCAP file), no map; valid is a map"),
        ("localise cut.refseq query.mcap", "cut.refseq: is not a .refseq map, or is damaged"),
        ("localise spoilt.refseq query.mcap", "spoilt.refseq"),
        ("map matrix atlas.refseq", "atlas.refseq: the map holds 2 paths, west, east; valid is a map of one"),
        (
            "report atlas.refseq query.mcap right.parquet --reference query.mcap -o x.html",
            "query.mcap: has the pictures of one drive, atlas.refseq is a map of several; valid is no reference",
        ),
        (
            "report atlas.refseq query.mcap wrong.parquet -o x.html",
            "wrong.parquet: comparison 'atlas.refseq ← query.mcap', stage 'chain', view 0: best place ",
        ),
    ],
)
def test_what_is_wrong_is_told_in_one_line(refseq: Refseq, here: Path, words: str, told: str) -> None:
    for name, map_file in (("right", "atlas.refseq"), ("wrong", "east.refseq")):
        if not (here / f"{name}.parquet").exists():
            refseq("localise", map_file, "query.mcap", "--stage", "chain", "-o", f"{name}.parquet")
    answer = refseq(*words.split())
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {told}")
    assert len(answer.err.splitlines()) == 1
    assert not list(here.glob("x.*"))


@pytest.mark.slow
def test_an_atlas_is_shown_alone_or_with_a_drive(refseq: Refseq, here: Path) -> None:
    refseq("localise", "atlas.refseq", "query.mcap", "--stage", "chain", "-o", "seen.parquet")
    for number, files in enumerate((["atlas.refseq"], ["atlas.refseq", "query.mcap", "seen.parquet"])):
        assert refseq("view", *files, "-o", f"seen-{number}.rrd").code == 0
    assert (here / "seen-1.rrd").stat().st_size > (here / "seen-0.rrd").stat().st_size > 0


@pytest.mark.slow
def test_a_report_shows_which_sequence_was_recognised(refseq: Refseq, here: Path) -> None:
    refseq("localise", "atlas.refseq", "query.mcap", "--stage", "chain", "-o", "told.parquet")
    answer = refseq("report", "atlas.refseq", "query.mcap", "told.parquet", "-o", "page.html")
    assert (answer.code, answer.err, answer.out) == (0, "", "page.html\n")
    page = (here / "page.html").read_text()
    assert "truly there" in page
    assert "P(sequence) = " in page
    assert page.count(">west<")
    assert page.count(">east<")
    assert "west, east" in page, "metadata of both drives"


def test_a_comparison_in_an_atlas_has_its_places_as_reference_views(here: Path) -> None:
    atlas, query = Map.load(here / "atlas.refseq"), read_recording(here / "query.mcap")
    found = compare("a ← q", atlas, query, stages=(Stage.UNIFORM,))
    first, second = map(len, atlas.sequences)
    assert found.drives == Drives(("west", "east"), (first, second))
    assert tuple(view.truth for view in found.reference_views) == atlas.poses
    for stretch, sequence in zip(found.stretches, atlas.sequences, strict=True):
        assert tuple(found.reference_views[stretch]) == places_as_views(Map.of(sequence))
    assert found.reference_metadata == {"world": "hallway", "route": "west, east"}
    assert found.query_metadata["light"] == "18:00"


def test_only_the_sensors_asked_for_are_used(here: Path) -> None:
    """The same as a localiser of these sensors, and not the same as one of all."""
    atlas, views = Map.load(here / "atlas.refseq"), read_recording(here / "query.mcap").views[:4]
    found = localise(atlas, views, stages=(Stage.CHAIN,), sensors=("laser",))[Stage.CHAIN]
    localiser = Localiser(atlas, sensors=("laser",))
    for belief, view in zip(found, views, strict=True):
        assert belief.places.tobytes() == localiser.update(view).places.tobytes()
    with_all = localise(atlas, views, stages=(Stage.CHAIN,))[Stage.CHAIN]
    assert any(a.places.tobytes() != b.places.tobytes() for a, b in zip(found, with_all, strict=True))
    with pytest.raises(MapError, match=r"^sensor 'sonar' is not in the map; valid are "):
        localise(atlas, views, sensors=("sonar",))


def test_views_are_counted_at_their_sequence_and_at_every_path_through_their_place(here: Path) -> None:
    atlas = Map.load(here / "atlas.refseq")
    size = len(atlas)
    lost = certain(size, 0, lost=0.9)
    runs = [
        {(s, p) for s, p in zip(path.sequences.tolist(), path.places.tolist(), strict=True)} for path in atlas.paths
    ]
    shared = runs[0] & runs[1]
    assert len(shared) >= 8
    for sequence, members in enumerate(map(len, atlas.sequences)):
        for place in range(members):
            beliefs = [lost, certain(size, int(atlas.first[sequence]) + place), lost]
            found = answers_by_path(atlas, beliefs)
            for number, name in enumerate(("west", "east")):
                assert found[name] == (int(number == sequence), int((sequence, place) in runs[number]))


def test_a_path_without_a_sequence_of_its_own_and_odd_names_are_told(here: Path) -> None:
    west = Map.load(here / "west.refseq")
    atlas = beside(named_maps(["[red]west"], [west]))
    way = replace(atlas.paths[0], name="again")
    atlas = replace(atlas, paths=(*atlas.paths, way))
    beliefs = {"a/chain": [certain(len(west), 3), certain(len(west), 4), certain(len(west), 4, lost=0.8)]}
    console = Console(file=StringIO(), width=80)
    console.print(sequence_recall_table(atlas, beliefs))
    assert isinstance(console.file, StringIO)
    text = console.file.getvalue()
    assert row(text, "[red]west") == [len(west), 2, 2]
    assert row(text, "again") == [0, 0, 2]
    assert row(text, "says lost") == [1]


# --- without truth ---


@pytest.fixture(scope="module")
def unseen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map and a drive of which no pose is known, and the map and the drive that know theirs."""
    folder = tmp_path_factory.mktemp("unseen")
    drive = corridor_drive(np.random.default_rng(1), count=24, size=96)
    for name, views in (("seen", drive), ("unseen", [replace(view, truth=None) for view in drive])):
        learn(views, profile=BEST, name=name).save(folder / f"{name}.refseq")
        with RecordingWriter(folder / f"{name}.mcap", {"light": "18:00"}) as writer:
            for number, view in enumerate(views[4:16]):
                writer.write(view, Pose(0.85 * number, 0.0, 0.0))
    return folder


@pytest.fixture
def blind(unseen: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(unseen)
    return unseen


@pytest.mark.quick_cases("seen-unseen-the query drive has no true poses")
@pytest.mark.parametrize(
    ("map_", "drive", "missing"),
    [
        ("seen", "unseen", "the query drive has no true poses"),
        ("unseen", "seen", "what was learnt has no true poses"),
        ("unseen", "unseen", "neither what was learnt nor the query has true poses"),
    ],
)
def test_without_truth_a_drive_is_localised_reported_and_shown(
    refseq: Refseq, blind: Path, map_: str, drive: str, missing: str
) -> None:
    words = [f"{map_}.refseq", f"{drive}.mcap"]
    answer = refseq("localise", *words, "-o", "b.parquet")
    assert (answer.code, answer.err) == (0, "")
    assert f"not scored: {missing}\n" in answer.out
    assert answer.out.count("n/a") >= 9  # within both tolerances, and failures, of three stages
    found = json.loads(refseq("localise", *words, "--json").out)
    assert found["unscored"] == missing
    (chain,) = [stage for stage in found["stages"] if stage["stage"] == "chain"]
    assert chain["failures"] is None
    assert (chain["odometry_jumps_steps"], chain["odometry_jumps_of_steps"]) == (0, 11 - chain["lost"])
    assert chain["odometry_slope"] == pytest.approx(1.0, abs=0.05)
    for command in (["report", *words, "b.parquet", "-o", "r.html"], ["view", *words, "b.parquet", "-o", "v.rrd"]):
        assert refseq(*command).code == 0
    assert f"No score: {missing}." in (blind / "r.html").read_text()


def test_a_page_is_of_the_views_that_were_localised(refseq: Refseq, blind: Path) -> None:
    """However they were chosen: here by thinning what noise was added to."""
    thinned = ["--views", "1:10", "--thin", "0.2", "--odometry-noise", "--seed", "5"]
    files = ["seen.refseq", "seen.mcap", "some.parquet"]
    answer = refseq("localise", *files[:2], *thinned, "-o", files[2], "--json")
    assert answer.code == 0
    for command in (["report", *files, "-o", "some.html"], ["view", *files, "-o", "some.rrd"]):
        assert refseq(*command).code == 0, command
    views = json.loads(answer.out)["views"]
    assert len(read_localised_views(blind / "some.parquet").times) == views < 10
    answer = refseq("report", "seen.refseq", "other.mcap", "some.parquet", "-o", "none.html")
    assert answer.code == 2
    answer = refseq("view", *files, "--thin", "1", "-o", "none.rrd")
    assert answer.err == "error: --views and --thin: beliefs tell which views they are of; valid is without\n"


def test_no_share_of_right_answers_can_be_asked_for_without_truth(refseq: Refseq, blind: Path) -> None:
    answer = refseq("localise", "unseen.refseq", "seen.mcap", "--at-least", "90", "-o", "none.parquet")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith("error: --at-least 90: what was learnt has no true poses")
    assert not (blind / "none.parquet").exists()


def test_truth_that_is_given_is_told_to_be_an_estimate(refseq: Refseq, blind: Path) -> None:
    known = [(view.time, view.truth) for view in read_recording(blind / "seen.mcap").views if view.truth]
    poses = [f"{time} {pose.x} {pose.y} 0 0 0 0 1" for time, pose in known]
    (blind / "poses.tum").write_text("\n".join(poses) + "\n")
    words = ["seen.refseq", "unseen.mcap", "--truth", "poses.tum"]
    answer = refseq("localise", *words, "-o", "b.parquet", "--at-least", "50")
    assert answer.code == 0
    assert "the truth is an estimate: poses.tum\n" in answer.out
    assert refseq("report", *words[:2], "b.parquet", *words[2:], "-o", "r.html").code == 0
    page = (blind / "r.html").read_text()
    assert "The truth is an estimate: poses.tum." in page
    assert re.search(r"<th>truth</th><td>n/a</td><td>poses.tum</td>", page)
