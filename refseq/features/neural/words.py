"""Words of the keys that a neural network finds in one camera's picture, as SIFT's are words."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features.neural.keys import SCALE, as_bytes, peaks, sampled
from refseq.features.neural.network import KeyNetwork, key_network
from refseq.features.vocabulary import Vocabulary
from refseq.features.word_extractor import KeyWords, PictureKeys
from refseq.view import View


class Digest(str):
    """A SHA-256 in hexadecimal digits, or nothing."""

    __slots__ = ()


NO_DIGEST = Digest()


@dataclass(frozen=True, slots=True)
class NeuralSettings:
    """Keys of a network that are used, and the distance within which their descriptors, of length 1, are one word.

    Pictures are brought to ``width`` × ``height`` pixels, for which the network was made. ``cap`` is the most keys that
    a picture gives, strongest first; none has a score below ``floor``. ``network`` is the SHA-256 of its file, which a
    map carries: another network's words mean nothing in it. Empty: whichever the user has.

    Vocabularies of more than ``exact_up_to`` words are matched as SIFT's are.
    """

    cap: int = 400
    floor: float = 0.05
    alias_distance: float = 0.5
    width: int = 640
    height: int = 480
    exact_up_to: int = 20_000
    network: Digest = NO_DIGEST


class NeuralWords(KeyWords):
    """Words of a camera's image. The network is opened by ``prepare``, or when it is first asked, and stays open."""

    settings: NeuralSettings

    def __init__(self, camera: str, settings: NeuralSettings, words: NDArray[np.uint8] | None = None) -> None:
        super().__init__()
        self.key = f"neural/{camera}"
        self.sensor = camera
        self.settings = settings
        self._opened: KeyNetwork | None = None
        self._fresh = words is None
        self._begin(np.zeros((0, 0), np.uint8) if words is None else words)

    def _begin(self, words: NDArray[np.uint8]) -> None:
        s = self.settings
        self.vocabulary = Vocabulary(SCALE * s.alias_distance, words, s.exact_up_to)

    def prepare(self) -> None:
        """Open the network. Raises ``MapError`` without it, and for words that it cannot have described."""
        network = self._network
        if self.size and self.vocabulary.words.shape[1] != network.depth:
            found = self.vocabulary.words.shape[1]
            raise MapError(f"{self.key}: words have {found} values; valid are the {network.depth} of its network")

    @property
    def _network(self) -> KeyNetwork:
        if self._opened is None:
            self._opened = key_network((self.settings.width, self.settings.height), self.settings.network)
        return self._opened

    def learn(self, view: View) -> NDArray[np.intp]:
        """Words of a reference view; unknown descriptors become words. Raises ``MapError`` without the network."""
        if self._fresh:
            self._begin(np.zeros((0, self._network.depth), np.uint8))
            self._fresh = False
        return super().learn(view)

    def find_keys(self, image: NDArray[np.uint8]) -> PictureKeys:
        """The keys with the best scores, at most ``cap``. Raises ``MapError`` without the network, or if it fails."""
        s, network = self.settings, self._network
        try:
            maps = network.maps(_brought(image, network.size))
        except ValueError as error:
            raise MapError(f"{self.key}: its network {error}") from None
        pixels = peaks(maps.score, s.floor, s.cap)
        scale = np.array(image.shape[::-1]) / network.size
        points = ((pixels + 0.5) * scale - 0.5).astype(np.float32)
        return PictureKeys(points, as_bytes(sampled(maps.descriptors, pixels, network.size)))


def _brought(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """A picture as large as the network takes it. Pixels that become fewer are averaged."""
    fewer = image.shape[1] >= size[0] and image.shape[0] >= size[1]
    way = cv2.INTER_AREA if fewer else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size, interpolation=way), np.uint8)


def pinned(settings: NeuralSettings) -> NeuralSettings:
    """The settings with the digest of the user's network. Raises ``MapError`` without one."""
    network = key_network((settings.width, settings.height), settings.network)
    return replace(settings, network=Digest(network.digest))
