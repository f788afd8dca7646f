from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.check import MOST, TOLERANCE, Checkup, RobotBox, check_world, geom_boxes
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan, parse_plan, world_names
from tests.worlds.conftest import corner

Text = Callable[..., str]
LIGHT = light_named("16:00")
ROBOT = RobotBox("cart", front=0.3, back=0.7, half_width=0.35, height=1.4)
METAL = "\n[material.metal]\nalbedo = 0.4\nroughness = 0.5\n"


def checked(text: str, robot: RobotBox = ROBOT) -> Checkup:
    """Findings in a plan, but for those of a corridor that is open at its ends."""
    checkup = check_world(parse_plan(text), LIGHT, [robot])
    return replace(checkup, findings=tuple(one for one in checkup.findings if "the building is open" not in one))


def test_a_wall_that_meets_no_other_leaves_the_building_open(small: Text) -> None:
    ends = SECOND_WALL + SECOND_WALL.replace("end]", "far]").replace('"end"', '"far"').replace("[8,", "[0,").replace(
        '"left"', '"right"'
    )
    assert check_world(parse_plan(small(end=ends)), LIGHT).findings == ()
    shorter = ends.replace("end = [0, 1.2]", "end = [0, 1.1]")
    assert check_world(parse_plan(small(end=shorter)), LIGHT).findings == (
        "wall 'left' meets no other one at x 0.00, y 1.20: the building is open there",
        "wall 'far' meets no other one at x 0.00, y 1.10: the building is open there",
    )


@pytest.mark.parametrize(
    ("start", "crowded"),
    [
        (
            (0.0, 1.0),
            ": walls 'end-2', 'inner-2', 'end' end at x 4.00, y 5.00; "
            "walls 'inner-1', 'end-1', 'room' end at x 0.00, y 1.00",
        ),
        ((1.0, 1.0), ""),
    ],
)
def test_a_room_beside_the_outline_is_told(start: tuple[float, float], crowded: str) -> None:
    x = start[0]
    ends = [(start, (x, 5.0)), ((x, 5.0), (4.0, 5.0))]
    room = "".join(SECOND_WALL.replace("[8, -1.2]", str([*a])).replace("[8, 1.2]", str([*b])) for a, b in ends)
    named = room.replace('"end"', '"room"', 1).replace('"left"', '"right"')
    (finding,) = check_world(parse_plan(corner() + named), LIGHT).findings[:1]
    assert finding.startswith(f"walls up to the ceiling enclose no one area{crowded}; floor and ceiling fill")


def test_an_empty_corridor_has_nothing_to_find(small: Text) -> None:
    checkup = checked(small())
    assert checkup.findings == ()
    # Two walls, and the slab of the ceiling.
    assert checkup.solids == 3
    assert checkup.seconds > 0
    assert checkup.megabytes > 0


@pytest.mark.quick_cases("hallway", "corridor:4", "offices")
@pytest.mark.parametrize("name", [*world_names(), "corridor:4"])
def test_nothing_is_found_in_worlds_that_are_good(name: str) -> None:
    assert check_world(load_plan(name), LIGHT, [ROBOT]).findings == ()


SECOND_WALL = """
[[wall]]
name = "end"
start = [8, -1.2]
end = [8, 1.2]
inside = "left"
material = "plaster"
"""


def test_a_cabinet_at_a_corner_stands_in_the_other_wall_s_cabinet(small: Text) -> None:
    """Along `left` c1 takes x 7.1 to 7.9 and 0.5 m of depth; along `end` c2 takes 0.4 m of depth and y 0.7 to 1.1."""
    text = small(end=SECOND_WALL + METAL) + (
        '[[cabinet]]\nname = "c1"\nwall = "left"\nat = 7.5\ndepth = 0.5\n'
        '[[cabinet]]\nname = "c2"\nwall = "end"\nat = 2.1\nwidth = 0.4\ndepth = 0.4\n'
    )
    (finding,) = checked(text).findings
    assert finding.startswith("cabinet 'c1' and cabinet 'c2' overlap by 0.30 m at x 7.")


def test_a_cabinet_that_stands_in_the_wall_round_the_corner(small: Text) -> None:
    """It ends 0.06 m before the end of its wall; the other wall is turned so that it lies 0.2 m nearer."""
    nearer = SECOND_WALL.replace("8, -1.2", "7.8, -1.2").replace("8, 1.2", "7.8, 1.2")
    text = small(end=nearer + METAL) + '[[cabinet]]\nname = "c1"\nwall = "left"\nat = 7.54\ndepth = 0.5\n'
    assert any("wall 'end'" in finding and "cabinet 'c1'" in finding for finding in checked(text).findings)


@pytest.mark.parametrize(("apart", "found"), [(TOLERANCE - 0.002, False), (TOLERANCE + 0.002, True)])
def test_things_may_stand_in_each_other_as_far_as_the_tolerance(small: Text, apart: float, found: bool) -> None:
    text = small(end=METAL) + (
        '[[furniture]]\nname = "a"\nkind = "box"\nat = [3, 0.9]\nwidth = 0.4\ndepth = 0.4\nheight = 1\n'
        'material = "metal"\n'
        f'[[furniture]]\nname = "b"\nkind = "box"\nat = [{3.4 - apart}, 0.9]\nwidth = 0.4\ndepth = 0.4\nheight = 1\n'
        'material = "metal"\n'
    )
    findings = checked(text).findings
    assert bool(findings) == found
    assert all(finding.startswith("box 'a' and box 'b' overlap by 0.01 m at x 3.") for finding in findings)


def test_of_many_findings_the_first_hundred_are_told(small: Text) -> None:
    """Twenty boxes in one place are 190 pairs."""
    boxes = ", ".join(
        f'{{ name = "b{k}", kind = "box", at = [3, 0.6], width = 0.5, depth = 0.5, height = 0.5, material = "door" }}'
        for k in range(20)
    )
    checkup = check_world(parse_plan(small(f"furniture = [{boxes}]")), LIGHT)
    overlaps = [one for one in checkup.findings if "overlap" in one]
    assert (len(overlaps), checkup.more) == (MOST, 190 - MOST)


def test_a_leaf_that_swings_into_a_wall(small: Text) -> None:
    """The door opens away from us, into the wall of another corridor that runs along behind it."""
    behind = (
        '[[wall]]\nname = "behind"\nstart = [0, 1.7]\nend = [8, 1.7]\ninside = "right"\nheight = 2.0\n'
        'material = "plaster"\n'
    )
    text = small('door = [{ name = "d1", wall = "left", at = 3, open = 60 }]', behind)
    findings = checked(text).findings
    assert any("door 'd1'" in finding and "wall 'behind'" in finding for finding in findings)


@pytest.mark.parametrize(("gap", "found"), [(1.42, False), (1.36, True)])
def test_rooms_behind_doors_that_overlap_are_told_as_rooms(small: Text, gap: float, found: bool) -> None:
    """Each goes on for 0.7 m past both sides of its door; the second door begins ``gap`` behind the first one's end."""
    doors = [f'{{ name = "d{k}", wall = "left", at = {at}, open = 90 }}' for k, at in ((1, 2), (2, 2.9 + gap))]
    findings = checked(small(f"door = [{', '.join(doors)}]")).findings
    rooms = "the room behind door 'd1' and the room behind door 'd2' overlap by 0.04 m at x 3."
    assert [one.startswith(rooms) for one in findings] == [True] * found


def test_a_room_behind_a_door_that_stands_on_a_route(small: Text) -> None:
    """The room of a door in a partition lies across the corridor; the door's own wall ends before the route."""
    wall = (
        '[[wall]]\nname = "stub"\nstart = [4, 1.2]\nend = [4, 0.2]\ninside = "right"\nheight = 2.5\n'
        'material = "plaster"\n'
    )
    text = small('door = [{ name = "d1", wall = "stub", at = 0.5, width = 0.6, open = 90 }]', wall)
    blocked = [one for one in checked(text).findings if one.startswith("route")]
    assert any("does not get past the room behind door 'd1'" in one for one in blocked)


def box(y: float) -> str:
    return (
        f'[[furniture]]\nname = "crate"\nkind = "box"\nat = [4.03, {y}]\nwidth = 0.5\ndepth = 0.5\nheight = 0.5\n'
        'material = "metal"\n'
    )


def test_a_box_on_the_route(small: Text) -> None:
    """It is touched when the robot's front, 0.3 + 0.05 m before its base, comes to the box's side, x 3.78."""
    (finding,) = checked(small(end=METAL) + box(0.0)).findings
    assert finding.startswith("route 'forward': robot 'cart' does not get past box 'crate' at x 3.50, y 0.00")


@pytest.mark.parametrize(("slack", "free"), [(0.02, True), (-0.02, False)])
def test_a_robot_gets_through_a_gap_that_is_as_wide_as_it_is(small: Text, slack: float, free: bool) -> None:
    """Half the robot and its clearance are 0.40 m; the box's side is 0.25 m from its middle."""
    findings = checked(small(end=METAL) + box(0.65 + slack)).findings
    assert (findings == ()) == free


def test_a_robot_that_turns_back_sweeps_its_tail_around(small: Text) -> None:
    """There and back along one line: at the far end its tail, 0.75 m long, passes over what stands beside the line."""
    text = small(end=METAL).replace("[[1, 0], [7, 0]]", "[[1, 0], [4, 0], [1, 0]]") + box(0.75)
    (finding,) = checked(text).findings
    assert "box 'crate' at x 4.00, y 0.00" in finding
    assert checked(text, RobotBox("disc", 0.3, 0.3, 0.3, 1.4)).findings == ()


@pytest.mark.parametrize(("height", "free"), [(0.02, True), (0.12, False)])
def test_a_low_kerb_is_rolled_over(small: Text, height: float, free: bool) -> None:
    kerb = f'[[kerb]]\nname = "k"\npoints = [[4, -1], [4, 1]]\nheight = {height}\nmaterial = "metal"\n'
    findings = checked(small(end=METAL) + kerb).findings
    assert (findings == ()) == free
    assert all("kerb 'k'" in finding for finding in findings)


def test_boxes_around_geoms_hold_their_corners() -> None:
    rng = np.random.default_rng(3)
    spec = mujoco.MjSpec()
    for i in range(5):
        quat = rng.normal(size=4)
        spec.worldbody.add_geom(
            name=f"g{i}", type=mujoco.mjtGeom.mjGEOM_BOX, size=rng.uniform(0.1, 1, 3), pos=rng.normal(size=3), quat=quat
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    low, high = geom_boxes(model, data)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    for i in range(model.ngeom):
        corners = data.geom_xpos[i] + (signs * model.geom_size[i]) @ data.geom_xmat[i].reshape(3, 3).T
        assert low[i] == pytest.approx(corners.min(axis=0))
        assert high[i] == pytest.approx(corners.max(axis=0))
