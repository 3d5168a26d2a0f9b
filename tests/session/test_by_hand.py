"""The loop with a person for a driver: with joints that are told, and without any."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.notations import NOTATIONS, pose_text, read_pose_text
from handeye.robots.manual import ManualRobot
from handeye.robots.protocol import Goal
from handeye.session.configuration import Prepared, begin, prepare
from handeye.session.deciding import EndReason
from handeye.session.starting import Start
from sessions import configured


class Typist:
    """A person who drives the simulated arm to the pose that is shown, and types what its pendant says."""

    def __init__(self, prepared: Prepared, *, joints: bool) -> None:
        self._prepared, self._joints = prepared, joints
        self.told: list[str] = []

    def tell(self, text: str) -> None:
        self.told.append(text)
        label = re.match(r"Go to (\S+):", text)
        arm = self._prepared.hidden_arm
        assert arm is not None
        if label is not None:
            line = next(line for line in text.splitlines() if line.strip().startswith("ur"))
            arm.move_to(Goal(label[1], read_pose_text(line.split("ur", 1)[1], NOTATIONS["ur"])))

    def ask(self, question: str) -> str:
        arm = self._prepared.hidden_arm
        assert arm is not None
        reading = arm.read_pose()
        if "joint positions" in question:
            degrees = " ".join(f"{value:.6f}" for value in np.rad2deg(reading.joints_rad or ()))
            return degrees if self._joints else ""
        return pose_text(reading.T_base_flange, NOTATIONS["ur"])


@pytest.mark.parametrize("joints", [True, False])
def test_a_person_reaches_what_was_asked_for(joints: bool, tmp_path: Path) -> None:
    prepared = prepare(configured(5, accuracy_mm=2.0, accuracy_deg=0.2))
    typist = Typist(prepared, joints=joints)
    robot = ManualRobot(typist.ask, typist.tell, arm=prepared.arm, joints_told=None if joints else False)
    assert prepared.start is not None
    start = replace(prepared.start, posture_known=joints)
    by_hand = replace(prepared, start=start, cell=replace(prepared.cell, robot=robot, by_hand=True))
    session, store = begin(by_hand, tmp_path / "s")
    end = session.run()
    store.close()
    assert end.reason is EndReason.ACCURACY_REACHED
    assert end.calibration is not None
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    off = (end.calibration.X @ prepared.truth.X.inverse()).log()
    assert np.linalg.norm(off[:3]) < 2e-3
    goals = [text for text in typist.told if text.startswith("Go to")]
    assert all(("joints" in text) == joints for text in goals)
    known = [view.joints_rad is not None for view in store.recording.views]
    assert all(known) if joints else not any(known)


def test_the_arm_has_to_be_named() -> None:
    with pytest.raises(InputError, match="no arm is named"):
        prepare(replace(configured(0), robot=None, driver="manual"))
    assert Start(prepare(configured(0)).start.T_base_flange, ()).posture_known  # type: ignore[union-attr]
