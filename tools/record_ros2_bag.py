"""Record what a cell in ROS 2 says into a bag (rosbag2, MCAP), until the input ends.

python tools/record_ros2_bag.py FOLDER

Stands in for `ros2 bag record`, which is not on the package index. Every fourth picture is kept.
"""

import sys
import time
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from handeye.ros.link import RosLink, ros_library

TOPICS = (
    ("/joint_states", "sensor_msgs", "JointState", False),
    ("/tf", "tf2_msgs", "TFMessage", False),
    ("/tf_static", "tf2_msgs", "TFMessage", True),
    ("/camera/camera_info", "sensor_msgs", "CameraInfo", False),
    ("/camera/image_raw", "sensor_msgs", "Image", False),
)
ONE_OF = {"/camera/image_raw": 4, "/camera/camera_info": 4}


def main() -> None:
    """Record until the input ends."""
    store = get_typestore(Stores.ROS2_JAZZY)
    link = RosLink("recorder")
    qos = ros_library("rclpy.qos")
    with Writer(Path(sys.argv[1]), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, package, kind, latched in TOPICS:
            connection = writer.add_connection(topic, f"{package}/msg/{kind}", typestore=store)
            count = [0]

            def take(
                raw: bytes, topic: str = topic, to: Connection = connection, count: list[int] = count
            ) -> None:
                count[0] += 1
                if count[0] % ONE_OF.get(topic, 1) == 0:
                    writer.write(to, time.time_ns(), bytes(raw))

            durability = qos.DurabilityPolicy.TRANSIENT_LOCAL if latched else qos.DurabilityPolicy.VOLATILE
            reliability = qos.ReliabilityPolicy.RELIABLE if latched else qos.ReliabilityPolicy.BEST_EFFORT
            profile = qos.QoSProfile(depth=50, durability=durability, reliability=reliability)
            messages = ros_library(f"{package}.msg")
            link.node.create_subscription(getattr(messages, kind), topic, take, profile, raw=True)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.read()
        link.close()


if __name__ == "__main__":
    main()
