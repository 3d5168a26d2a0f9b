"""Cameras: for now the one that renders a target."""

from handeye.cameras.render import Appearance, BoardRenderer, clutter, render

__all__ = ["Appearance", "BoardRenderer", "clutter", "render"]
