import re
from collections.abc import Callable
from pathlib import Path
from zoneinfo import available_timezones

import pytest

from refseq_bench.worlds.errors import PlanError, UnknownWorldError
from refseq_bench.worlds.plans.load import load_plan, parse_plan, world_names
from tests.worlds.conftest import in_the_open

Text = Callable[..., str]


def message(text: str) -> str:
    with pytest.raises(PlanError) as caught:
        parse_plan(text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_small_plan_is_good(small: Text) -> None:
    assert parse_plan(small()).wall_named("left").length == 8.0


def test_all_worlds_of_the_library_load() -> None:
    assert "hallway" in world_names()
    for name in world_names():
        assert load_plan(name).name == name


def test_unknown_world() -> None:
    with pytest.raises(UnknownWorldError) as caught:
        load_plan("halway")
    seeds = "corridor:SEED, building:SEED (a whole number from 0, 18 digits at most)"
    known = f"{', '.join(world_names())}, {seeds}, or a path ending in .toml"
    assert str(caught.value) == f"unknown world 'halway'; known are {known}"


@pytest.mark.parametrize("name", ["flat.xml", "plans/flat.URDF", "flat.obj"])
def test_a_model_of_another_program_is_told_as_one(name: str) -> None:
    ending = Path(name).suffix.replace(".", "[.]")
    with pytest.raises(PlanError, match=rf"^{name}: is a model \({ending}\), which is not read; valid is a floor plan"):
        load_plan(name)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"nowhere\.toml: cannot be read: No such file or directory$"):
        load_plan(tmp_path / "nowhere.toml")


def test_toml_syntax_names_file_and_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nwall = [\n')
    with pytest.raises(PlanError, match=r"^mine\.toml: is no TOML: .*line 2|end of document"):
        load_plan(path)


def test_a_door_outside_its_wall(small: Text) -> None:
    said = message(small('door = [{ name = "d1", wall = "left", at = 7.8 }]'))
    assert said == (
        "plan.toml: door[0].at: 7.8: door 'd1' spans 7.35 to 8.25 m, outside wall 'left' (0 to 8 m); "
        "valid is 0.45 to 7.55"
    )


def test_a_window_wider_than_its_wall(small: Text) -> None:
    said = message(small('window = [{ name = "w1", wall = "right", at = 4, width = 9 }]'))
    assert said == (
        "plan.toml: window[0].width: 9: window 'w1' spans -0.5 to 8.5 m, outside wall 'right' (0 to 8 m); "
        "a width of at most 8 fits"
    )


def test_a_window_above_its_wall(small: Text) -> None:
    said = message(small('window = [{ name = "w1", wall = "right", at = 4, sill = 2.0 }]'))
    assert said == (
        "plan.toml: window[0]: window 'w1' ends 3.5 m above the floor, outside wall 'right', which is 2.8 m high; "
        "lower or shorten it"
    )


def test_a_wall_as_long_as_no_building(small: Text) -> None:
    said = message(small().replace("end = [8, -1.2]", "end = [8000, -1.2]", 1))
    assert said == "plan.toml: wall[1].end: wall 'right' is 8000 m long; it should be at most 500 m"


def test_a_leaf_deeper_than_its_wall(small: Text) -> None:
    said = message(small('door = [{ name = "d1", wall = "left", at = 4, recess = 0.2 }]'))
    assert said == "plan.toml: door[0].recess: 0.2 is not valid; wall 'left' is 0.15 m thick"


def test_overlapping_openings(small: Text) -> None:
    doors = '{ name = "d1", wall = "left", at = 3 }, { name = "d2", wall = "left", at = 3.5 }'
    said = message(small(f"door = [{doors}]"))
    assert said == "plan.toml: door[1].at: 3.5: 'd2' overlaps 'd1', which takes 2.55 to 3.45 m of wall 'left'"


def test_openings_that_touch_do_not_overlap(small: Text) -> None:
    doors = '{ name = "d1", wall = "left", at = 3 }, { name = "d2", wall = "left", at = 3.9 }'
    assert len(parse_plan(small(f"door = [{doors}]")).door) == 2


@pytest.mark.parametrize(
    ("top", "said"),
    [
        (
            'door = [{ name = "d1", wall = "left", at = 3, widht = 1 }]',
            "door[0].widht: unknown key; valid keys are name, wall, at, width, height, recess, open, hinge, depth, "
            "label, material",
        ),
        ('door = [{ name = "d1", wall = "left" }]', "door[0].at: missing; it is required"),
        ('door = [{ name = "d1", wall = "left", att = 3 }]', "door[0].att: unknown key; valid keys are name, wall, at, "
         "width, height, recess, open, hinge, depth, label, material"),
        (
            'door = [{ name = "d 1", wall = "left", at = 3.0 }]',
            "door[0].name: 'd 1' is not valid; it should be letters, digits, points, dashes and underscores, a letter "
            "or digit first",
        ),
        (
            'door = [{ name = "d1", wall = "left", at = "3" }]',
            "door[0].at: '3' is not valid; it should be a valid number",
        ),
        (
            'door = [{ name = "d1", wall = "left", at = 3, width = -1 }]',
            "door[0].width: -1 is not valid; it should be greater than 0",
        ),
        (
            'door = [{ name = "d1", wall = "left", at = nan }]',
            "door[0].at: nan is not valid; it should be a finite number",
        ),
        ('door = [{ name = "d1", wall = "up", at = 3 }]', "door[0].wall: unknown wall 'up'; known are left, right"),
        (
            'door = [{ name = "d1", wall = "left", at = 3, material = "gold" }]',
            "door[0].material: unknown material 'gold'; known are plaster, door",
        ),
        (
            'poster = [{ name = "p1", wall = "left", at = 3, style = "pop" }]',
            "poster[0].style: 'pop' is not valid; it should be 'text', 'plots', 'photo', 'mixed', 'diagram' or "
            "'whiteboard'",
        ),
        (
            'kerb = [{ name = "k", points = [[0.0, 0.0]] }]',
            "kerb[0].points: [[0.0, 0.0]] is not valid; it should be a list of 2 or more",
        ),
        (
            'title = "\\u001b[2J"',
            "title: '\\x1b[2J' is not valid; it should be a line of characters that can be printed",
        ),
        (
            'tree = [{ name = "t", at = [4, 0], height = 1.8 }]',
            "tree[0].crown: 1.8 is not valid; it should be less than the tree's height, 1.8",
        ),
        (
            'tree = [{ name = "t", at = [4, 0], height = 3 }]',
            "tree[0].height: 3 is not valid; the ceiling is 2.8 m high",
        ),
        (
            'post = [{ name = "p", at = [4, 0] }]',
            "post[0]: 'p' lights streets, and the plan has a ceiling; valid is a [[lamp]]",
        ),
        (
            'lamp = [{ name = "l", first = [1, 0], step = [0, 0], count = 4, lumen = 12000.0 }]',
            "lamp[0].step: [0.0, 0.0] of 'l' is not valid; 4 lamps would hang in each other; valid is 1.2 m along x or "
            "0.3 m along y at least",
        ),
        (
            'marking = [{ name = "m", points = [[1, 0], [3, 0], [3, 0]], material = "plaster" }]',
            "marking[0].points[2]: [3.0, 0.0] is the point before it; valid are points apart",
        ),
        (
            'kerb = [{ name = "k", points = [[1, 0], [1, 0]], material = "plaster" }]',
            "kerb[0].points[1]: [1.0, 0.0] is the point before it; valid are points apart",
        ),
        (
            'board = [{ name = "b", wall = "left", at = 3, width = 0.005 }]',
            "board[0].width: 0.005 is not valid; it should be at least 0.01 m",
        ),
        ("colour = 1", "colour: unknown key; valid keys are name, title, place, floor, ceiling, material, wall, "
         "window, door, poster, board, cabinet, bin, fixture, furniture, stairs, car, tree, kerb, marking, post, "
         "person, lamp, routes"),
    ],
)  # fmt: skip
def test_each_mistake_is_one_line(small: Text, top: str, said: str) -> None:
    assert message(small(top)) == f"plan.toml: {said}"


def test_a_day_of_which_no_sun_is_known_is_told(small: Text) -> None:
    said = message(small().replace("2008-03-20", "9999-12-31"))
    assert said.startswith("plan.toml: place.date: 9999-12-31 is not valid; it should be less than")


@pytest.mark.parametrize(
    ("was", "given", "said"),
    [
        (
            "thickness = 0.3",
            "thickness = 30",
            "wall[1].thickness: 30 is not valid; it should be metres, from 0.01 to 5",
        ),
        ("[floor]", "[floor]\ntile = 0.0001", "floor.tile: 0.0001 is not valid; it should be metres, from 0.01 to 20"),
        ("[ceiling]", "[ceiling]\npanel = 60", "ceiling.panel: 60 is not valid; it should be metres, from 0.05 to 20"),
        (
            "start = [0, 1.2]\nend = [8, 1.2]",
            "start = [0, 1200]\nend = [18000, 1200]",
            "wall[0].end[0]: 18000 is not valid; it should be metres, from -10000 to 10000",
        ),
        (
            "start = [0, 1.2]",
            "start = [-18000, 1.2]",
            "wall[0].start[0]: -18000 is not valid; it should be metres, from -10000 to 10000",
        ),
        ("height = 2.8", "height = 28000", "ceiling.height: 28000 is not valid; it should be metres, at most 10000"),
    ],
)
def test_a_measure_in_another_unit_is_told(small: Text, was: str, given: str, said: str) -> None:
    assert message(small().replace(was, given, 1)) == f"plan.toml: {said}"


@pytest.mark.parametrize(
    ("key", "value", "valid"), [("width", 0.09, "0.3 to 20"), ("height", 0.2, "0.3 to 20"), ("depth", 500, "0.1 to 50")]
)
def test_a_door_in_another_unit_is_told(small: Text, key: str, value: float, valid: str) -> None:
    said = message(small(f'door = [{{ name = "d1", wall = "left", at = 2, {key} = {value} }}]'))
    assert said == f"plan.toml: door[0].{key}: {value:g} is not valid; it should be metres, from {valid}"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("heading = 7200000", "person[0].heading: 7200000 is not valid; it should be degrees, from -10000 to 10000"),
        ("speed = 12000", "person[0].speed: 12000 is not valid; it should be metres a second, at most 10000"),
    ],
)
def test_what_is_no_length_is_told_in_its_own_unit(small: Text, given: str, said: str) -> None:
    assert message(small(f'person = [{{ name = "p", at = [4, 0], {given} }}]')) == f"plan.toml: {said}"


def test_an_unknown_key_of_the_ceiling_is_told(small: Text) -> None:
    said = message(small().replace("[ceiling]\n", "[ceiling]\ncolour = 1\n"))
    assert said == "plan.toml: ceiling.colour: unknown key; valid keys are height, material, panel"


def test_a_row_of_lamps_in_the_open_air_is_told() -> None:
    row = '[[lamp]]\nname = "l"\nfirst = [1, 0]\nstep = [1, 0]\ncount = 2\nlumen = 3000\n'
    said = "plan.toml: lamp[0]: 'l' hangs from a ceiling, and the plan has none; valid is a [[post]]"
    assert message(in_the_open(row)) == said


def test_a_material_used_by_default_must_exist(small: Text) -> None:
    text = small('cabinet = [{ name = "c1", wall = "left", at = 3 }]')
    assert message(text) == "plan.toml: cabinet[0].material: unknown material 'metal'; known are plaster, door"


def test_a_name_taken_twice(small: Text) -> None:
    posters = '{ name = "p", wall = "left", at = 2 }, { name = "p", wall = "left", at = 5 }'
    said = message(small(f"poster = [{posters}]"))
    assert said == "plan.toml: poster[1].name: 'p' is already taken; every poster needs its own name"


def test_a_route_through_the_wall(small: Text) -> None:
    said = message(small(end="out = [[1, 0], [1, 3]]"))
    assert said == "plan.toml: routes.out[1]: [1.0, 3.0] lies outside the walls; valid is x 0 to 8, y -1.2 to 1.2"


@pytest.mark.parametrize(
    ("top", "said"),
    [
        (
            'furniture = [{ name = "t", kind = "table", at = [4, 2], width = 1, depth = 1, height = 1, '
            'material = "door" }]',
            "furniture[0].at: [4.0, 2.0] lies outside the walls; valid is x 0 to 8, y -1.2 to 1.2",
        ),
        (
            'kerb = [{ name = "k", points = [[1, 0], [9, 0]], material = "plaster" }]',
            "kerb[0].points[1]: [9.0, 0.0] lies outside the walls; valid is x 0 to 8, y -1.2 to 1.2",
        ),
        (
            'person = [{ name = "p", at = [1, 0], walk = [[2, 0], [2, 5]] }]',
            "person[0].walk[1]: [2.0, 5.0] lies outside the walls; valid is x 0 to 8, y -1.2 to 1.2",
        ),
        (
            'lamp = [{ name = "l", first = [1, 0], step = [3, 0], count = 4, lumen = 3000 }]',
            "lamp[0], lamp 4 of its row: [10.0, 0.0] lies outside the walls; valid is x 0 to 8, y -1.2 to 1.2",
        ),
    ],
)
def test_what_stands_free_stands_between_the_walls(small: Text, top: str, said: str) -> None:
    assert message(small(top)) == f"plan.toml: {said}"


def test_a_wall_that_looks_out_of_the_building(small: Text) -> None:
    right = small()
    place = right.index("inside = ")
    word = right[place + 10 : right.index('"', place + 10)]
    other = "right" if word == "left" else "left"
    said = message(right[: place + 10] + right[place + 10 :].replace(word, other, 1))
    assert re.fullmatch(
        rf"plan\.toml: wall\[0\]\.inside: '{other}' of wall '\w+' is outside the building; valid is '{word}'", said
    )


def test_walls_of_rooms_that_overlap_go_through_each_other(small: Text) -> None:
    room = [((3, 0), (6, 0)), ((6, 0), (6, 4)), ((6, 4), (3, 4)), ((3, 4), (3, 0))]
    walls = "".join(
        f'[[wall]]\nname = "r{i}"\nstart = {list(start)}\nend = {list(end)}\n'
        + 'inside = "left"\nmaterial = "plaster"\n'
        for i, (start, end) in enumerate(room)
    )
    assert message(small(end=walls)) == (
        "plan.toml: wall[3]: wall 'r1' goes through wall 'left' at [6.0, 1.2]; "
        "valid are walls that meet at their ends: an outline about rooms that overlap"
    )


@pytest.mark.parametrize(
    ("routes", "said"),
    [
        ("", "routes: it holds none; valid is one at least, as forward = [[x, y], [x, y]]"),
        (
            "forward = [[1, 0], [1, 0]]",
            "routes.forward[1]: [1.0, 0.0] is the point before it; valid are points apart",
        ),
    ],
)
def test_a_route_leads_somewhere(small: Text, routes: str, said: str) -> None:
    assert message(small().replace("forward = [[1, 0], [7, 0]]", routes)) == f"plan.toml: {said}"


def test_one_table_in_place_of_several(small: Text) -> None:
    said = message(small(end='[board]\nname = "b"\n'))
    assert said.endswith("it should be one of several tables: [[board]] in place of [board]")


def test_a_ceiling_in_centimetres(small: Text) -> None:
    said = message(small().replace("height = 2.8", "height = 280"))
    assert said == "plan.toml: ceiling.height: 280 is not valid; it should be metres, at most 50"


def test_a_plan_in_the_open_air(small: Text) -> None:
    roofless = small().replace('[ceiling]\nheight = 2.8\nmaterial = "plaster"\n', "")
    assert message(roofless) == (
        "plan.toml: floor.area: missing; a plan without a ceiling needs the corners of its ground, [[x, y], [x, y]]"
    )
    ground = roofless.replace("[floor]\n", "[floor]\narea = [[-5, -9], [20, 9]]\n")
    assert message(ground) == "plan.toml: wall[0].height: missing; in the open air every wall needs one"
    flat = ground.replace("[20, 9]", "[20, -9]")
    assert message(flat) == (
        "plan.toml: floor.area: ((-5.0, -9.0), (20.0, -9.0)) is not valid; it should be two opposite corners"
    )
    parse_plan(
        ground.replace("end = [8, 1.2]", "end = [8, 1.2]\nheight = 3").replace("thickness", "height = 3\nthickness")
    )


def test_under_a_ceiling_the_walls_tell_the_area_and_the_height(small: Text) -> None:
    area = small().replace("[floor]\n", "[floor]\narea = [[-5, -9], [20, 9]]\n")
    assert message(area) == (
        "plan.toml: floor.area: ((-5.0, -9.0), (20.0, 9.0)) is not valid; "
        "under a ceiling the walls tell where the floor ends"
    )
    high = small().replace("thickness", "height = 3\nthickness")
    assert message(high) == (
        "plan.toml: wall[1].height: 3 is not valid; the ceiling is 2.8 m high: leave the height out"
    )


def test_a_window_into_another_corridor() -> None:
    from tests.worlds.conftest import corner

    text = 'window = [{ name = "w", wall = "inner-1", at = 2 }]\n' + corner()
    assert message(text) == (
        "plan.toml: window[0].wall: 'inner-1' has parts of the plan behind it; windows fit in walls at its edge"
    )


@pytest.mark.parametrize("zone", ["Europe/Aveiro", "Europe", "", "zone.tab", "/etc/localtime", "../etc", "posixrules"])
def test_unknown_time_zone(small: Text, zone: str) -> None:
    said = message(small().replace("Europe/Lisbon", zone))
    assert said == (
        f"plan.toml: place.timezone: '{zone}' is not valid; "
        "it should be a time zone of the IANA list, such as Europe/Lisbon"
    )


def test_all_zones_of_the_list_are_known(small: Text) -> None:
    for zone in sorted(available_timezones())[::20]:
        assert parse_plan(small().replace("Europe/Lisbon", zone)).place.timezone == zone


def test_a_plan_cannot_be_changed(small: Text) -> None:
    plan = parse_plan(small())
    with pytest.raises(ValueError, match="frozen"):
        plan.ceiling.height = 3.0
