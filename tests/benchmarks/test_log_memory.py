"""Memory that reading a long log takes: two VGA cameras at 30 Hz, odometry at 50 Hz, as JPEG pictures in MCAP.

``python -m tests.benchmarks.test_log_memory 60`` measures an hour.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from foxglove import messages
from mcap.writer import CompressionType, Writer

from refseq.planar import Pose
from tests.refseq.logs.foxglove_drive import ns, pose_message

CAMERA_RATE, ODOMETRY_RATE, SPEED = 30, 50, 0.5
MOST = 500.0
"""Peak resident memory of the whole process [MB]."""

READ = """
import sys
from pathlib import Path
from refseq.logs import read_recording
from tests.benchmarks.peak import peak_bytes
views = read_recording(Path(sys.argv[1]), thin=0.85).views
pixels = sum(int(image[0, 0]) * 0 + image.size for view in views for image in view.images.values())
print(len(views), pixels, peak_bytes() / 1e6)
"""


def pictures(count: int = 20) -> list[bytes]:
    """VGA pictures with as much in them as JPEG makes some 30 kB of."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(count):
        coarse = rng.integers(0, 256, (96, 128), np.uint8)
        image = cv2.resize(coarse, (640, 480), interpolation=cv2.INTER_CUBIC)
        found.append(cv2.imencode(".jpg", image, (int(cv2.IMWRITE_JPEG_QUALITY), 50))[1].tobytes())
    return found


def write_long_log(path: Path, minutes: float) -> None:
    """A robot that drives straight on, with the foxglove SDK's messages and the mcap library's writer."""
    jpegs = pictures()
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        channels = {}
        for topic, kind in (
            ("/left", messages.CompressedImage),
            ("/right", messages.CompressedImage),
            ("/odom", messages.Odometry),
        ):
            schema = kind.get_schema()
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[topic] = writer.register_channel(topic, "protobuf", number)
        for tick in range(int(minutes * 60 * 150)):  # the least common multiple of the rates
            time = 1.7e9 + tick / 150
            stamp = messages.Timestamp(sec=ns(time) // 10**9, nsec=ns(time) % 10**9)
            if tick % (150 // CAMERA_RATE) == 0:
                for side, topic in enumerate(("/left", "/right")):
                    data = jpegs[(tick + side) % len(jpegs)]
                    image = messages.CompressedImage(timestamp=stamp, frame_id=topic, data=data, format="jpeg")
                    writer.add_message(channels[topic], ns(time), image.encode(), ns(time))
            if tick % (150 // ODOMETRY_RATE) == 0:
                pose = pose_message(Pose(SPEED * tick / 150, 0, 0))
                message = messages.Odometry(timestamp=stamp, frame_id="odom", body_frame_id="base_link", pose=pose)
                writer.add_message(channels["/odom"], ns(time), message.encode(), ns(time))
        writer.finish()


def measured(minutes: float, folder: Path) -> tuple[int, float, float]:
    """Views, their pixels [MB], and the peak of resident memory [MB] of a process that reads them."""
    path = folder / "long.mcap"
    write_long_log(path, minutes)
    told = subprocess.run([sys.executable, "-c", READ, path], capture_output=True, text=True, check=True).stdout
    path.unlink()
    views, pixels, peak = told.split()
    return int(views), int(pixels) / 1e6, float(peak)


@pytest.mark.benchmark
@pytest.mark.slow
def test_memory_is_bounded_by_the_views_that_are_kept(tmp_path: Path) -> None:
    views, pixels, peak = measured(10, tmp_path)
    assert views == pytest.approx(10 * 60 * SPEED / 0.85, rel=0.05)
    assert pixels > 200
    # 36 000 pictures of 307 kB would be 11 GB.
    assert peak < MOST


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        print("views {}, pixels {:.0f} MB, peak {:.0f} MB".format(*measured(float(sys.argv[1]), Path(name))))
