"""Whole calibrations by `handeye run` through the protocols of devices on loopback, judged by the truth.

A cell with a truth stands behind a controller (`--robot ur`) and a camera: pylon's emulator of cameras, which
needs the extra basler (`--camera basler`), or the cell itself (`--camera mock`). Pictures are rendered.

python tools/measure_drivers.py --camera basler --seeds 1 2 3
"""

import argparse
import io
import json
import os
import tempfile
import time
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint
from pathlib import Path

import cv2
import numpy as np

from handeye import extension
from handeye.cli.boundary import run
from handeye.session import drivers
from handeye.testing import MockCell
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.types import Pose

SPACE_MM = ("-1100", "-1100", "20", "1100", "1100", "1300")
SERIAL = "0815-0000"


class Shown(MockCell):
    """A cell whose picture lies in a file, new whenever the arm comes to rest: what an emulator shows."""

    file: Path | None = None

    def stand(self, joints_rad: tuple[float, ...] | None) -> None:
        """Come to rest, and show what is seen there."""
        super().stand(joints_rad)
        if self.file is not None:
            cv2.imwrite(str(self.file), self.picture(f"shown_{time.monotonic_ns()}"))


def emulated(cell: Shown, folder: Path) -> str:
    """Let pylon's emulator show the cell; return the specification of the camera."""
    from pypylon import pylon  # noqa: PLC0415 - only where it is asked for

    cell.file = folder / "scene.png"
    cell.stand(cell.start_rad)
    found = pylon.DeviceInfo()
    found.SetSerialNumber(SERIAL)
    camera = pylon.InstantCamera(pylon.TlFactory.GetInstance().CreateFirstDevice(found))
    camera.Open()
    camera.ImageFileMode.Value, camera.TestImageSelector.Value = "On", "Off"
    camera.ImageFilename.Value = str(cell.file)
    camera.Width.Value, camera.Height.Value = cell.camera.size_px
    pylon.FeaturePersistence.Save(str(folder / "camera.pfs"), camera.GetNodeMap())
    camera.Close()
    return f"basler:{SERIAL},{folder / 'camera.pfs'}"


def of_the_cell(cell: Shown) -> str:
    """Announce the cell itself as a camera; return its specification."""

    class Point(EntryPoint):
        def load(self) -> object:
            return lambda _: cell

    def announced(group: str) -> dict[str, EntryPoint]:
        found = extension.announced(group)
        return found | {"mock": Point("mock", "", group)} if group == extension.CAMERAS else found

    drivers.announced = announced
    return "mock"


def calibrated(arguments: argparse.Namespace, seed: int, folder: Path) -> dict[str, object]:
    """Run one calibration; return what came of it."""
    cell = Shown("ur5e", seed=seed)
    controller = MockUniversalRobot(cell, pace=arguments.pace)
    camera, target = cell.write(folder)
    images = emulated(cell, folder) if arguments.camera == "basler" else of_the_cell(cell)
    command = ["run", "--session", str(folder / "session"), "--robot", "ur5e", "--no-confirm", "--json"]
    command += ["--driver", f"ur:{controller.address}", "--images", images, "--speed-deg-s", "60"]
    command += ["--camera", str(camera), "--target", str(target), "--workspace-mm", *SPACE_MM]
    printed, began = io.StringIO(), time.monotonic()
    with redirect_stdout(printed):
        run(command)
    controller.close()
    answer = json.loads(printed.getvalue())
    if "error" in answer:
        return {"seed": seed, "error": answer["error"]["message"]}
    T_flange_camera = Pose(answer["calibration"]["T_flange_camera"])
    truth = cell.truth.X
    off = (truth @ T_flange_camera).log() if truth is not None else np.full(6, np.nan)
    return {
        "seed": seed,
        "end": answer["end"],
        "views": answer["views"],
        "attempts": answer["attempts"],
        "off_mm": round(1e3 * float(np.linalg.norm(off[:3])), 3),
        "off_deg": round(float(np.rad2deg(np.linalg.norm(off[3:]))), 4),
        "seconds": round(time.monotonic() - began, 1),
    }


def main() -> None:
    """Print a line a seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", choices=["ur"], default="ur")
    parser.add_argument("--camera", choices=["basler", "mock"], default="mock")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--pace", type=float, default=4.0, help="so many times faster than stated")
    arguments = parser.parse_args()
    os.environ["PYLON_CAMEMU"] = "1"
    for seed in arguments.seeds:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(calibrated(arguments, seed, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
