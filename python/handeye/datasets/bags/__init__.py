"""Bags of ROS 1, rosbag2 and MCAP, read without ROS.

Libraries for bags make code out of the definitions in the file and run it; here only messages whose layout is
known are read, with bounds on everything a file can ask for (docs/adr/0013).
"""

from handeye.datasets.bags.contents import Contents, fetch_pictures, read_contents
from handeye.datasets.bags.folder import is_bag
from handeye.datasets.bags.pictures import grey_of
from handeye.datasets.bags.tracks import Station, TimesOf, Track, chain, parents, rising, stations, way

__all__ = [
    "Contents",
    "Station",
    "TimesOf",
    "Track",
    "chain",
    "fetch_pictures",
    "grey_of",
    "is_bag",
    "parents",
    "read_contents",
    "rising",
    "stations",
    "way",
]
