"""The page in a real browser: sessions by clicks and by typing, and what a second page may do."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from browsers import NARROW, Window, browser, needs_browser, serious
from handeye.datasets import write_rig
from handeye.datasets.shipped import shipped_recording
from handeye.notations import NOTATIONS, pose_text, read_pose_text
from handeye.robots.protocol import Goal
from handeye.session.configuration import prepare
from handeye.session.settings import Configuration
from handeye.simulation.cells import ErrorKind
from handeye.simulation.rigs import simulate_rig

pytestmark = needs_browser
QUICK = ("--points-only", "0.1")
# Nothing ends it by itself before a busy machine has pressed a button.
LONG = ("--accuracy-mm", "0.001", "--max-views", "400", "--anyway")


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browser(tmp_path_factory.mktemp("browser")) as open_window:
        yield open_window


@contextmanager
def command(*arguments: str | Path) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """Run a command with a page; give its address and the process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "handeye", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        address = re.search(r"http://\S+", line)
        assert address is not None, line + process.stderr.read()
        yield address[0], process
    finally:
        process.kill()
        process.communicate()


def state(window: Window, pattern: str) -> None:
    from playwright.sync_api import expect

    expect(window.page.locator("#state")).to_have_text(re.compile(pattern), timeout=60_000)


def press(window: Window, action: str) -> None:
    window.page.click(f"[data-action={action}]")


def is_painted(window: Window, selector: str) -> bool:
    """Tell whether a canvas shows more than one colour."""
    shot = window.page.locator(selector).screenshot()
    image = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR)
    return float(image.std()) > 5.0


def finished(window: Window, process: "subprocess.Popen[str]") -> dict[str, Any]:
    press(window, "finish")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    return json.loads(out)


def test_a_whole_session_by_clicks(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    with command("run", "--session", tmp_path / "s", *QUICK, "--ui", "--json") as (address, process):
        one = opened(address)
        state(one, r"view_01\.1.*Waiting for you")
        for number in (2, 3, 4):
            press(one, "go")
            state(one, rf"view_0{number}\.1.*Waiting")
        press(one, "skip")
        state(one, r"view_04\.2.*Waiting")
        expect(one.page.locator("#failure")).to_have_text("view_04.1: not confirmed")
        press(one, "go")
        state(one, r"view_05\.1.*Waiting")
        press(one, "withdraw")
        expect(one.page.locator("#views tr")).to_have_count(3)
        one.page.get_by_role("button", name="Mark view_02 as bad").click()
        expect(one.page.locator("#views tr")).to_have_count(2)
        state(one, r"small turn.*Waiting")
        press(one, "here")
        expect(one.page.locator("#views tr")).to_have_count(3)
        state(one, "Waiting")
        # The page is only a page: loaded again it shows the same, and still drives.
        one.page.reload()
        state(one, "Waiting")
        expect(one.page.locator("#people")).to_have_text("You drive.")
        two = opened(address, NARROW)
        state(two, "Waiting")
        expect(two.page.locator("#people")).to_have_text(re.compile("You look on; 1 more page"))
        expect(two.page.locator("[data-action=go]")).to_be_disabled()
        expect(two.page.locator("[data-action=stop]")).to_be_enabled()
        two.page.click("#take-over")
        expect(two.page.locator("#people")).to_have_text(re.compile("You drive"))
        expect(one.page.locator("[data-action=go]")).to_be_disabled()
        assert two.page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]
        press(two, "run_on")
        state(two, "Ended: .* as asked")
        assert is_painted(two, "#scene")
        two.page.fill("#more-mm", "0.2")
        two.page.fill("#more-deg", "0.02")
        two.page.click("#more button")
        expect(two.page.locator("#now")).to_have_text(re.compile(r"asked: 0\.2 mm and 0\.02 deg"))
        two.page.reload()  # what it says of its state is not that of before
        state(two, "Ended: .* as asked|Ended: .* views taken")
        one.check()
        two.check()
        answer = finished(two, process)
    assert answer["end"] in {"accuracy_reached", "views_taken"}
    assert answer["views"] >= 5
    assert answer["report"] is not None


def test_stop_ends_the_run_and_pauses(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    with command("run", "--session", tmp_path / "s", *QUICK, "--ui", *LONG) as (address, _):
        one = opened(address)
        state(one, "Waiting")
        press(one, "run_on")
        state(one, "Deciding|moves to")
        press(one, "stop")
        expect(one.page.locator("#log")).to_contain_text("Stop was pressed.")
        state(one, "Waiting")
        one.check()


def test_faults_of_robot_and_camera_are_shown_and_passed(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    faults = ("--faults", "0.12", "--seed", "3")
    with command("run", "--session", tmp_path / "s", *QUICK, *faults, "--ui", "--json") as (address, process):
        one = opened(address)
        state(one, "Waiting")
        press(one, "run_on")
        state(one, "Ended: ")
        expect(one.page.locator("#log div").first).to_be_visible()
        answer = finished(one, process)
        one.check()
    assert answer["attempts"] > answer["views"]


def test_by_hand_with_typed_poses_and_brought_pictures(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    # The person: a simulated arm that is driven to what the page shows, and its camera.
    person = prepare(Configuration("epson_c4l", seed=4))
    arm = person.hidden_arm
    assert arm is not None
    (tmp_path / "camera.json").write_text(json.dumps(person.cell.camera.to_dict()))
    (tmp_path / "target.json").write_text(json.dumps(person.cell.target.to_dict()))
    (tmp_path / "in").mkdir()
    arguments = ["run", "--session", tmp_path / "s", "--robot", "epson_c4l", "--driver", "manual:ur/m"]
    arguments += ["--images", f"folder:{tmp_path / 'in'}", "--camera", tmp_path / "camera.json"]
    arguments += ["--target", tmp_path / "target.json", "--ui", "--json"]
    arguments += ["--workspace-mm", "-1100", "-1100", "20", "1100", "1100", "1400"]

    def pose() -> str:
        return pose_text(arm.read_pose().T_base_flange, NOTATIONS["ur"])

    def answer(window: Window, question: str, text: str) -> None:
        expect(window.page.locator("#question-text")).to_have_text(re.compile(question), timeout=60_000)
        window.page.fill("#answer", text)
        window.page.click("#question button")

    with command(*arguments) as (address, process):
        one = opened(address, NARROW)
        answer(one, "pose of the flange now", "12 13")
        expect(one.page.locator("#log")).to_contain_text("a pose is written as")
        answer(one, "pose of the flange now", pose())
        answer(one, "joint positions", "")
        for number in (1, 2, 3):
            goals = one.page.locator("#log div", has_text=f"Go to view_0{number}.")
            expect(goals.last).to_be_visible(timeout=60_000)
            line = re.search(r"ur +(p\[.*?\])", goals.last.text_content())
            assert line is not None
            arm.move_to(Goal("by hand", read_pose_text(line[1], NOTATIONS["ur"])))
            answer(one, rf"view_0{number}\.1: pose reached", pose())
            expect(one.page.locator("#log")).to_contain_text(f"view_0{number}.1: save a picture into")
            frame = person.cell.source.grab(f"view_0{number}.1")
            assert frame.image is not None
            _, png = cv2.imencode(".png", frame.image)
            upload = {"name": "a.png", "mimeType": "image/png", "buffer": png.tobytes()}
            one.page.set_input_files("#file", upload)
            expect(one.page.locator("#views tr")).to_have_count(number, timeout=60_000)
        expect(one.page.locator("#coverage")).to_contain_text("parts of the picture")
        assert is_painted(one, "#picture")
        assert serious(one) == []
        expect(one.page.locator("#question-text")).to_have_text(re.compile("view_04"), timeout=60_000)
        one.page.get_by_role("button", name="Stop").click()
        answer(one, "pose of the flange now.*Enter if it has not moved", "")
        state(one, "Waiting")
        found = finished(one, process)
        one.check()
    assert found["views"] == 3
    assert found["end"] == "by_hand"


@pytest.mark.parametrize("words", [("solve",), ("plan", "--first", "4"), ("ui",), ("replay",)])
def test_pages_about_a_folder(opened: Any, words: tuple[str, ...]) -> None:
    from playwright.sync_api import expect

    more = () if words[0] == "ui" else ("--ui",)
    with command(words[0], shipped_recording(), *words[1:], *more) as (address, _):
        one = opened(address)
        state(one, r"\d+ views, model auto")
        expect(one.page.locator("#buttons")).to_be_hidden()
        first = one.page.locator("#views button").first
        name = first.text_content()
        first.click()
        expect(one.page.locator("#picture-text")).to_contain_text(f"{name}: ")
        assert is_painted(one, "#scene")
        if words[0] == "replay":
            expect(one.page.locator("#key")).to_have_text("as taken planned")
        if words[0] == "plan":
            one.page.click("summary")
            expect(one.page.locator("#candidates li").first).to_contain_text("(next)")
        assert serious(one) == []
        one.check()


def test_all_cameras_of_a_rig(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    recording = simulate_rig(ErrorKind.WHITE_FLANGE, 2)
    write_rig(recording, tmp_path / "rig")
    with command("solve", tmp_path / "rig", "--ui") as (address, _):
        one = opened(address)
        state(one, rf"{len(recording.cameras)} cameras, \d+ stations")
        for name in recording.cameras:
            expect(one.page.locator("#now")).to_contain_text(f"{name}: within ")
            expect(one.page.locator("#coverage")).to_contain_text(f"of the picture of {name}")
        name = list(recording.cameras)[-1]
        one.page.locator("#views button", has_text=f"{name} / ").first.click()
        expect(one.page.locator("#picture-text")).to_contain_text(re.compile(rf"{name} / .*px RMS"))
        expect(one.page.locator("#limits")).to_have_text(re.compile("What limits the accuracy of "))
        assert is_painted(one, "#scene")
        one.page.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
        assert one.page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]
        assert serious(one) == []
        one.check()


def test_a_rig_is_driven_by_clicks(opened: Any, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    asked = ("--accuracy-mm", "0.001", "--accuracy-deg", "0.0001", "--seed", "2")
    arguments = ("run", "--rig", "--cameras", "left", "front", "--session", tmp_path / "s", *asked)
    with command(*arguments, "--ui", "--json") as (address, process):
        one = opened(address)
        for number in (1, 2, 3, 4, 5):
            state(one, rf"station_0{number}\.1: .*Waiting")
            press(one, "go")
        state(one, r"station_06\.1: the place that teaches most.*Waiting")
        for name in ("left", "front"):
            expect(one.page.locator("#now")).to_contain_text(f"{name}: within ")
            expect(one.page.locator("#key")).to_contain_text(name)
        expect(one.page.locator("#picture-text")).to_contain_text(re.compile(r"(left|front) / .*px RMS"))
        one.page.click("summary")
        expect(one.page.locator("#candidates li").first).to_contain_text("(next)")
        press(one, "skip")
        expect(one.page.locator("#failure")).to_have_text("station_06.1: not confirmed")
        press(one, "withdraw")
        expect(one.page.locator("#views button", has_text="station_05")).to_have_count(0)
        # A station goes as a whole, whatever cameras saw something there.
        one.page.get_by_role("button", name="Mark station_02 as bad").click()
        expect(one.page.locator("#views button", has_text="station_02")).to_have_count(0)
        press(one, "here")
        expect(one.page.locator("#views button", has_text="station_0")).not_to_have_count(0)
        one.page.reload()
        state(one, "Waiting")
        expect(one.page.locator("#people")).to_have_text("You drive.")
        two = opened(address, NARROW)
        expect(two.page.locator("[data-action=go]")).to_be_disabled()
        assert two.page.evaluate("document.documentElement.scrollWidth") <= NARROW[0]
        press(one, "run_on")
        state(one, "Deciding|moves to")
        press(two, "stop")
        state(one, "Waiting")
        answer = finished(one, process)
        one.check()
        two.check()
    assert answer["end"] == "by_hand"
    assert set(answer["cameras"]) == {"left", "front"}
    assert answer["attempts"] > answer["stations"]


def test_the_page_can_be_used_without_seeing_or_pointing(opened: Any, tmp_path: Path) -> None:
    with command("run", "--session", tmp_path / "s", *QUICK, "--ui") as (address, _):
        one = opened(address)
        state(one, "Waiting")
        for number in (2, 3, 4):
            press(one, "go")
            state(one, rf"view_0{number}\.1.*Waiting")
        for size in ((1360, 900), NARROW):
            one.page.set_viewport_size({"width": size[0], "height": size[1]})
            assert serious(one) == []
        before = one.page.locator("#scene").screenshot()
        one.page.focus("#scene")
        one.page.keyboard.press("ArrowLeft")
        one.page.wait_for_timeout(200)
        assert one.page.locator("#scene").screenshot() != before
