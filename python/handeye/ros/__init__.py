"""ROS 2, live: a node in a thread of its own, and messages that are taken by their stamps, never the latest.

`stamps` and `transforms` know nothing of ROS; only `link` imports its library, and only once it is opened.
"""

from handeye.ros.link import RosLink, options_of
from handeye.ros.stamps import Stamped, Stream
from handeye.ros.transforms import Transforms

__all__ = ["RosLink", "Stamped", "Stream", "Transforms", "options_of"]
