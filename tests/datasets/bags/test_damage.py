"""Small bags with bytes changed, cut out or put in at random: read, or refused in words."""

from pathlib import Path

import numpy as np
import pytest

from bags_written import Sink
from handeye.datasets.bags import is_bag, read_contents
from handeye.errors import InputError
from handeye.types import Pose

pytest.importorskip("rosbags", reason="rosbags, which writes the bags, is not installed")
ROUNDS = 120


def small(path: Path, kind: str) -> Path:
    """A bag of a few messages of every type."""
    sink = Sink(path, kind)
    with sink:
        for k in range(4):
            transform = sink.transform(0.1 * k, "base_link", "tool0", Pose.exp([0.1 * k, 0, 0, 0, 0, 0.1]))
            sink.say(
                "/tf",
                "tf2_msgs/msg/TFMessage",
                0.1 * k,
                sink.make("tf2_msgs/msg/TFMessage", transforms=[transform]),
            )
            image = sink.make(
                "sensor_msgs/msg/Image", header=sink.header(0.1 * k, "c"), height=4, width=4, encoding="mono8",
                is_bigendian=0, step=4, data=np.zeros(16, np.uint8),
            )  # fmt: skip
            sink.say("/image", "sensor_msgs/msg/Image", 0.1 * k, image)
            joints = sink.make(
                "sensor_msgs/msg/JointState", header=sink.header(0.1 * k, ""), name=["a", "b"],
                position=np.zeros(2), velocity=np.zeros(0), effort=np.zeros(0),
            )  # fmt: skip
            sink.say("/joint_states", "sensor_msgs/msg/JointState", 0.1 * k, joints)
    return sink.path


def files(bag: Path) -> list[Path]:
    return [bag] if bag.is_file() else sorted(bag.iterdir())


@pytest.mark.parametrize("kind", ["rosbag1", "rosbag1-lz4", "sqlite3", "mcap", "mcap-zstd"])
def test_damaged_bags_raise_only_our_errors(kind: str, tmp_path: Path) -> None:
    bag = small(tmp_path / "bag", kind)
    assert is_bag(bag)
    whole = read_contents(bag)
    assert len(whole.transforms["base_link", "tool0"].values) == 4
    assert len(whole.pictures["/image"].made_ns) == 4
    random = np.random.default_rng(5)
    refused = 0
    for _ in range(ROUNDS):
        path = files(bag)[int(random.integers(len(files(bag))))]
        right = path.read_bytes()
        content = bytearray(right)
        at = int(random.integers(len(content)))
        how = int(random.integers(4))
        if how == 0:
            content[at] = int(random.integers(256))
        elif how == 1:
            del content[at : at + int(random.integers(1, 50))]
        elif how == 2:
            content[at : at + 8] = b"\xff" * 8
        else:
            content[at:at] = bytes(random.integers(0, 256, 8).tolist())
        path.write_bytes(bytes(content))
        try:
            read_contents(bag)
        except InputError as error:
            refused += 1
            assert str(bag) in error.message or str(path) in error.message
        path.write_bytes(right)
    assert refused > 5
