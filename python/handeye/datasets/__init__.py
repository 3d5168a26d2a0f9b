"""Recordings on disk: our own format, and importers for the layouts of others.

An importer gives an `ImageSet`, images and poses in which the points are still to be found; our format gives
a `Recording`, ready to be solved.
"""

from handeye.datasets.camera_files import read_camera, read_cameras
from handeye.datasets.image_set import ImageSet, ImportOptions, Shot, UnreadPoses
from handeye.datasets.importer import Imported, Importer
from handeye.datasets.loading import IMPORTERS, load
from handeye.datasets.parameter_files import read_target
from handeye.datasets.plausibility import DataWarning, recording_warnings
from handeye.datasets.pose_files import PoseTable, read_pose_rows, read_poses
from handeye.datasets.pose_pairs import PosePair, PosePairs
from handeye.datasets.pose_rows import PoseRows, Reading, Statement
from handeye.datasets.read_back import check_written, check_written_rig
from handeye.datasets.recording_format import LoadedRecording, read_recording
from handeye.datasets.recording_header import holds_several
from handeye.datasets.recording_writing import write_recording
from handeye.datasets.rig_description import RigDescription, read_rig_description
from handeye.datasets.rig_format import LoadedRig, read_rig, rig_warnings
from handeye.datasets.rig_writing import write_rig

__all__ = [
    "IMPORTERS",
    "DataWarning",
    "ImageSet",
    "ImportOptions",
    "Imported",
    "Importer",
    "LoadedRecording",
    "LoadedRig",
    "PosePair",
    "PosePairs",
    "PoseRows",
    "PoseTable",
    "Reading",
    "RigDescription",
    "Shot",
    "Statement",
    "UnreadPoses",
    "check_written",
    "check_written_rig",
    "holds_several",
    "load",
    "read_camera",
    "read_cameras",
    "read_pose_rows",
    "read_poses",
    "read_recording",
    "read_rig",
    "read_rig_description",
    "read_target",
    "recording_warnings",
    "rig_warnings",
    "write_recording",
    "write_rig",
]
