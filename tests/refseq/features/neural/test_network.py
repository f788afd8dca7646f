from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import laplace

from refseq.errors import MapError
from refseq.features.neural.network import FILE, key_network
from tests.key_network import CELL, DEPTH, write_key_network

SIZE = 96, 64


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's network, for pictures of ``SIZE``."""
    monkeypatch.setenv(FILE, str(tmp_path / "keys.onnx"))
    return write_key_network(tmp_path / "keys.onnx", *SIZE)


def picture(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, SIZE[::-1], dtype=np.uint8)


def test_the_maps_are_what_the_graph_says(file: Path) -> None:
    found = key_network(SIZE).maps(picture())
    np.testing.assert_allclose(found.score, np.abs(laplace(picture() / 255, mode="constant")), atol=1e-5)
    assert found.descriptors.shape == (DEPTH, SIZE[1] // CELL, SIZE[0] // CELL)


def test_threads_that_share_a_network_get_each_its_own_answer(file: Path) -> None:
    """OpenCV's networks take one picture at a time."""
    network, pictures = key_network(SIZE), [picture(seed) for seed in range(8)]
    alone = [network.maps(one).score.copy() for one in pictures]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(network.maps, pictures * 20))
    assert all(np.array_equal(found.score, alone[number % 8]) for number, found in enumerate(together))


def test_the_network_is_opened_once_and_again_when_its_file_changes(file: Path) -> None:
    first = key_network(SIZE)
    assert key_network(SIZE) is first
    write_key_network(file, *SIZE, seed=2, depth=24)
    again = key_network(SIZE)
    assert (first.depth, again.depth) == (DEPTH, 24)
    assert first.digest != again.digest


def test_another_network_than_the_maps_is_refused(file: Path) -> None:
    own, other = key_network(SIZE).digest, "ab" * 32
    assert key_network(SIZE, own).digest == own
    with pytest.raises(MapError) as caught:
        key_network(SIZE, other)
    assert str(caught.value) == f"{FILE}: {file}: is sha256 {own[:12]}…; valid is an ONNX file of sha256 abababababab…"


def test_a_network_that_is_not_named_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FILE, "  ")
    with pytest.raises(MapError, match=f"{FILE} names no neural network to find keys by; valid is the path of an ONNX"):
        key_network(SIZE)


def test_files_that_are_no_network_are_refused_in_one_line(file: Path) -> None:
    whole = file.read_bytes()
    wrong = {
        b"": "is no ONNX network that OpenCV reads",
        b"a picture": "is no ONNX network that OpenCV reads",
        whole[: len(whole) // 2]: "is no ONNX network that OpenCV reads",
        whole.replace(b"score", b"value"): r"does not answer to 96 × 64 pixels with score and descriptors",
        whole.replace(b"image", b"scene"): r"does not answer to 96 × 64 pixels with score and descriptors",
    }
    for content, reason in wrong.items():
        file.write_bytes(content)
        with pytest.raises(MapError, match=reason) as caught:
            key_network(SIZE)
        assert str(caught.value).startswith(f"{FILE}: {file}: ")
        assert "\n" not in str(caught.value)


def test_what_is_no_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path, reason in ((tmp_path, "is a folder"), (tmp_path / "none", "No such file")):
        monkeypatch.setenv(FILE, str(path))
        with pytest.raises(MapError, match=f"{FILE}: {path}: cannot be read: {reason}"):
            key_network(SIZE)


def test_a_network_for_pictures_of_another_size_is_refused(file: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MapError, match=r"answers with score \(1, 1, 64, 96\) .* valid are \(1, 1, 128, 160\)"):
        key_network((160, 128))
    assert capfd.readouterr() == ("", ""), "OpenCV says nothing beside it"


def test_numbers_that_are_not_finite_are_refused(file: Path) -> None:
    content = file.read_bytes()
    nothing = np.zeros(SIZE[0] * SIZE[1], np.float32).tobytes()
    assert content.count(nothing) == 1
    file.write_bytes(content.replace(nothing, np.full(SIZE[0] * SIZE[1], np.nan, np.float32).tobytes()))
    with pytest.raises(MapError, match="answers with numbers that are not finite"):
        key_network(SIZE)
