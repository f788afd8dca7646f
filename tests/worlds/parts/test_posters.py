import cv2
import numpy as np
import pytest

from refseq_bench.worlds.parts import posters


def keypoints(image: np.ndarray) -> int:
    return len(cv2.SIFT_create().detect(image, None))


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("style", ["text", "plots", "photo", "mixed", "diagram"])
def test_posters_are_full_of_features(style: str) -> None:
    assert keypoints(posters.poster((0.841, 1.189), style, rng())) > 200


def test_notice_boards_are_full_of_features() -> None:
    assert keypoints(posters.notice_board((1.8, 1.0), 12, rng())) > 500
