"""The answer in the formats of others, with frames and units that cannot be misread."""

from handeye.export import easy_handeye2, moveit, opencv, plain_json, ros1, ros2, urdf
from handeye.export.base import Exporter
from handeye.export.frames import REP_103_OPTICAL, Frames
from handeye.export.mount import Mount
from handeye.export.moveit_samples import moveit_samples
from handeye.export.result import Result, read_result
from handeye.export.transforms import Transform, checked_text, read_transform

EXPORTERS: dict[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        ros2.EXPORTER,
        urdf.EXPORTER,
        ros1.EXPORTER,
        moveit.PYTHON_EXPORTER,
        moveit.XML_EXPORTER,
        easy_handeye2.EXPORTER,
        opencv.EXPORTER,
        plain_json.EXPORTER,
    )
}

__all__ = [
    "EXPORTERS",
    "REP_103_OPTICAL",
    "Exporter",
    "Frames",
    "Mount",
    "Result",
    "Transform",
    "checked_text",
    "moveit_samples",
    "read_result",
    "read_transform",
]
