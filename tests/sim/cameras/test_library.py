import tomllib
from dataclasses import asdict
from pathlib import Path

import pytest

from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.cameras.library import camera_names, load_camera, parse_camera
from refseq_bench.sim.errors import SimError
from tests.pages import Page

LIBRARY = Path(__file__).parents[3] / "sim/cameras/library"


def test_the_library_has_the_fire_i_with_both_lenses() -> None:
    assert camera_names() == ("fire-i", "fire-i-wide")


@pytest.mark.parametrize("name", camera_names())
def test_every_camera_of_the_library_fits_its_lens_to_its_sensor(name: str) -> None:
    assert load_camera(name).optics().shading.shape == (480, 640)


def test_the_fire_is_table_is_complete_and_says_what_the_code_says() -> None:
    assert load_camera("fire-i") == CameraModel()
    text = LIBRARY.joinpath("fire-i.toml").read_text(encoding="utf-8")
    for key, value in asdict(CameraModel()).items():
        for name in value if isinstance(value, dict) else (key,):
            assert f"\n{name} = " in text


def test_the_page_has_every_key_of_the_fire_i() -> None:
    (table,) = (one for one in Page("docs/sim.md").examples if "quantum_efficiency" in one.code)
    assert tomllib.loads(table.code) == tomllib.loads(LIBRARY.joinpath("fire-i.toml").read_text(encoding="utf-8"))


def test_the_wide_one_differs_in_its_lens_only() -> None:
    wide = load_camera("fire-i-wide")
    assert (wide.sensor, wide.exposure, wide.gamma) == (CameraModel().sensor, CameraModel().exposure, 2.2)
    assert wide.lens.focal / wide.sensor.pixel == pytest.approx(388, abs=1)


def test_a_file_gives_what_it_says_and_the_fire_i_for_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("[sensor]\nsize = [320, 240]\n[exposure]\nshutter = [1e-3, 1e-2]\n", encoding="utf-8")
    mine = load_camera(path)
    assert mine.sensor.size == (320, 240)
    assert mine.exposure.shutter == (1e-3, 1e-2)
    assert mine.lens == CameraModel().lens
    assert load_camera(str(path)) == mine


MISTAKES = {
    "gamma = 0": "gamma = 0.0 is not > 0 and finite",
    "gamma = 'two'": "gamma = 'two' is not a number",
    "gamma = true": "gamma = True is not a number",
    "gama = 2.2": "gama: unknown key; valid are gamma, lens, sensor, exposure",
    "lens = 3": "lens = 3 is not a table",
    "[lens]\nfocl = 1": "lens.focl: unknown key; valid are focal, f_number, transmission, k1, k2, corner_loss, blur",
    "[lens]\nfocal = nan": "lens.focal = nan is not > 0 and finite",
    "[lens]\nfocal = 4.3": (
        "lens.focal = 4.3 and sensor.pixel = 5.6e-06, both in metres, give a field of view of 0.048 degrees; valid is "
        "1 degree or more"
    ),
    "[sensor]\npixel = 5.6e-9": (
        "lens.focal = 0.0043 and sensor.pixel = 5.6e-09, both in metres, give a field of view of 0.048 degrees; valid "
        "is 1 degree or more"
    ),
    "[lens]\nk1 = 50": "lens: k1, k2 = 50, 0 draw the corner 2.8 times as far out as without; valid is up to 2 times",
    "[lens]\nk2 = 900": "lens: k1, k2 = 0, 900 draw the corner 2.6 times as far out as without; valid is up to 2 times",
    "[lens]\nblur = 1000": "lens.blur = 1000.0 is not >= 0 and <= 20 pixels",
    "[lens]\nf_number = 200": "lens.f_number = 200.0 is not >= 0.5 and <= 64",
    "[sensor]\nsize = [1, 1]": "sensor.size = (1, 1) is not two of 16 to 8192 pixels",
    "[exposure]\nlag = 300": "exposure.lag = 300.0 is not > 0 and <= 60 s",
    "[exposure]\nshutter = [0.1, 66.7]": "exposure.shutter = 66.7 is not <= 10 s",
    "[sensor]\nsize = [640]": "sensor.size = [640] is not a pair",
    "[sensor]\nsize = [640, 480, 3]": "sensor.size = [640, 480, 3] is not a pair",
    "[sensor]\nsize = 640": "sensor.size = 640 is not a pair",
    "[sensor]\nsize = [640.5, 480]": "sensor.size = 640.5 is not a whole number",
    "[exposure]\ngain = [4, 2]": "exposure.gain = (4.0, 2.0) is not 0 < least <= most",
    "[exposure]\ngain = ['a', 2]": "exposure.gain = 'a' is not a number",
}


@pytest.mark.parametrize(("text", "message"), MISTAKES.items(), ids=list(MISTAKES.values()))
def test_every_mistake_is_one_line_with_file_key_value_and_what_is_valid(text: str, message: str) -> None:
    with pytest.raises(SimError) as caught:
        parse_camera(text, "mine.toml")
    assert str(caught.value) == f"mine.toml: {message}"


def test_what_is_no_camera_is_told(tmp_path: Path) -> None:
    with pytest.raises(
        SimError, match=r"^unknown camera 'nikon': valid are fire-i, fire-i-wide, or a path to a .toml$"
    ):
        load_camera("nikon")
    with pytest.raises(SimError, match=r"nothing\.toml: cannot be read: No such file or directory$"):
        load_camera(tmp_path / "nothing.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(SimError, match=r"bytes\.toml: cannot be read: not UTF-8 text$"):
        load_camera(tmp_path / "bytes.toml")
    with pytest.raises(SimError, match=r"^camera\.toml: is no TOML: "):
        parse_camera("gamma =")
