import math

import numpy as np
import pytest

from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.world_survey.contact_sheet import contact_sheet
from refseq_bench.scenarios.world_survey.snapshots import Snapshot, places_on, pose_along, snapshots
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.worlds.conftest import SMALL

CORNER = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])


@pytest.mark.parametrize(
    ("along", "pose"), [(0, (0, 0, 0)), (3, (3, 0, 0)), (4, (4, 0, math.pi / 2)), (7, (4, 3, math.pi / 2))]
)
def test_a_place_on_a_route_faces_along_it(along: float, pose: tuple[float, float, float]) -> None:
    found = pose_along(CORNER, along)
    assert (found.x, found.y, found.heading) == pytest.approx(pose)


@pytest.mark.parametrize("along", [-0.1, 7.1, math.nan])
def test_a_place_off_the_route_is_told_with_those_on_it(along: float) -> None:
    with pytest.raises(ScenarioError, match=rf"^place {along:g} m is not on the route; valid is 0 to 7$"):
        pose_along(CORNER, along)


def test_three_places_a_quarter_apart_unless_others_are_asked_for() -> None:
    drive = Drive(world="hallway")
    assert places_on(drive, None) == (24.0, 48.0, 72.0)
    assert places_on(drive, [3.5]) == (3.5,)
    with pytest.raises(ScenarioError, match=r"^unknown route 'up' in world 'hallway'; valid are forward, reverse$"):
        places_on(Drive(world="hallway", route="up"), None)


@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")
def test_a_still_shows_the_place_in_its_light(tmp_path: object) -> None:
    path = tmp_path / "small.toml"  # type: ignore[operator]
    lamp = '[[lamp]]\nname = "row"\nfirst = [2, 0]\nstep = [2, 0]\ncount = 3\nlumen = 1000\n'
    path.write_text(SMALL.format(top="", end=lamp))
    drive = Drive(world=str(path), sensors=("camera-1",), renderer=RendererKind.FILAMENT)
    found = list(snapshots(drive, ("late-evening", "23:00,lamps=off"), (1.0, 3.0)))
    assert [(still.light, still.along, still.pose.x) for still in found] == [
        ("late-evening", 1.0, pytest.approx(2.0)),
        ("late-evening", 3.0, pytest.approx(4.0)),
        ("23:00,lamps=off", 1.0, pytest.approx(2.0)),
        ("23:00,lamps=off", 3.0, pytest.approx(4.0)),
    ]
    lit, dark = (np.mean([still.images["camera-1"].mean() for still in found[k : k + 2]]) for k in (0, 2))
    assert lit > 2 * dark


def test_a_sheet_has_a_cell_for_each_place_camera_and_light() -> None:
    from refseq.planar import Pose

    image = np.zeros((48, 64), np.uint8)
    cells = [
        Snapshot(light, along, Pose(0, 0, 0), {"camera-1": image, "camera-2": image})
        for light in ("noon", "18:00", "20:00")
        for along in (1.0, 2.0)
    ]
    axes = contact_sheet("small", cells).axes
    assert len(axes) == 12
    assert [one.get_title() for one in axes[:3]] == ["noon", "18:00", "20:00"]
    assert [one.get_ylabel() for one in axes[::3]] == [f"{a} m, camera-{c}" for a in (1, 2) for c in (1, 2)]
