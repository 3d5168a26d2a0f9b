"""Pictures of a board by MuJoCo: a renderer that is not ours, for cells rebuilt from what others published.

Needs the extra `sim`. MuJoCo's cameras are pinholes, look along -z with y up, and have their pixel centres at
integers plus one half; a board is a texture on a flat mesh, lit evenly.
"""

import importlib
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import InputError
from handeye.pattern import Pattern
from handeye.types import Camera, Target
from handeye.types.arrays import FloatArray

# White around what is printed, and samples of the texture per smallest detail.
MARGIN_M, PER_DETAIL, MOST_TEXELS = 0.015, 24, 4096
# How far the back of the board stands behind its face: a mesh that is flat is refused.
DEPTH_M = 0.002

SCENE = """
<mujoco>
  <visual>
    <global offwidth="{width}" offheight="{height}"/>
    <quality offsamples="8"/>
    <headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>
    <map znear="0.02" zfar="20"/>
  </visual>
  <asset>
    <texture name="grey" type="skybox" builtin="flat" rgb1="0.45 0.45 0.45" width="16" height="16"/>
    <texture name="print" type="2d" file="board.png"/>
    <material name="print" texture="print" specular="0" shininess="0"/>
    <mesh name="board" vertex="{vertices}" face="{faces}" texcoord="{corners}"/>
  </asset>
  <worldbody>
    <geom type="mesh" mesh="board" material="print"/>
    <camera name="eye" pos="0 0 -1" fovy="{fovy}"/>
  </worldbody>
</mujoco>
"""


class MujocoPictures:
    """Pictures of one board through one pinhole whose centre is that of the picture.

    Parameters
    ----------
    target
        The board.
    camera
        Lens without distortion, focal lengths alike.

    Raises
    ------
    InputError
        The package `mujoco` is not installed, or a camera that MuJoCo does not have.
    """

    def __init__(self, target: Target, camera: Camera) -> None:
        try:
            mujoco: Any = importlib.import_module("mujoco")
        except ImportError as error:
            raise InputError(
                "the package mujoco is not installed",
                code=Code.MISSING_PACKAGE,
                hint="pip install 'handeye[sim]'; without a display set MUJOCO_GL=egl or osmesa",
            ) from error
        fx, fy, cx, cy = camera.parameters[:4]
        width, height = camera.size_px
        centred = np.allclose([cx, cy], [(width - 1) / 2, (height - 1) / 2]) and np.isclose(fx, fy)
        if not centred or np.any(camera.parameters[4:] != 0):
            raise InputError(
                "MuJoCo's cameras are centred pinholes: no distortion, one focal length",
                code=Code.UNSUPPORTED_CAMERA,
            )
        fovy = float(np.rad2deg(2 * np.arctan(height / (2 * fy))))
        picture, low, high = _texture(target)
        # The face towards the camera, and a point behind it.
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        vertices = [(x, y, 0.0) for x, y in corners] + [(*((low + high) / 2), DEPTH_M)]
        xml = SCENE.format(
            width=width,
            height=height,
            fovy=fovy,
            vertices=" ".join(f"{value:.9f}" for vertex in vertices for value in vertex),
            faces="0 2 1 0 3 2 0 1 4 1 2 4 2 3 4 3 0 4",
            corners="0 0 1 0 1 1 0 1 0.5 0.5",
        )
        ok, png = cv2.imencode(".png", picture)
        if not ok:
            raise AssertionError("OpenCV always writes PNG")
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(xml, {"board.png": png.tobytes()})
        # Meshes are moved to their centre of mass when they are read; the geom is put back by the compiler.
        self._data = mujoco.MjData(self._model)
        self._renderer = mujoco.Renderer(self._model, height, width)

    def picture(self, T_camera_target: FloatArray) -> NDArray[np.uint8]:
        """Return the picture (height, width), grey, of the board at a pose (4, 4)."""
        mujoco, model = self._mujoco, self._model
        pose = np.linalg.inv(T_camera_target)
        # From x right, y down, z ahead to x right, y up, z back.
        rotation = pose[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, rotation.ravel())
        model.cam_pos[0], model.cam_quat[0] = pose[:3, 3], quaternion
        mujoco.mj_forward(model, self._data)
        self._renderer.update_scene(self._data, "eye")
        colours = self._renderer.render()
        return np.asarray(cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY), dtype=np.uint8)

    def close(self) -> None:
        """Give the graphics context back."""
        self._renderer.close()


def _texture(target: Target) -> tuple[NDArray[np.uint8], FloatArray, FloatArray]:
    """Return what is printed, with a white border, and the corners (2,) of it in the plane of the target."""
    pattern = Pattern(target)
    low, high = pattern.low - MARGIN_M, pattern.high + MARGIN_M
    texel = max(pattern.finest_m / PER_DETAIL, float((high - low).max()) / MOST_TEXELS)
    columns, rows = (int(n) for n in np.ceil((high - low) / texel))
    x = low[0] + (np.arange(columns) + 0.5) * (high[0] - low[0]) / columns
    y = low[1] + (np.arange(rows) + 0.5) * (high[1] - low[1]) / rows
    plane = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    dark = pattern.is_dark(plane).reshape(rows, columns)
    return np.where(dark, np.uint8(25), np.uint8(230)), low, high
