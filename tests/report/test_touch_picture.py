"""Touch error on the page: its numbers, and a map with every point at its place."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from commands import Handeye
from folders import written
from handeye.estimation import solve
from handeye.estimation.work import Work
from handeye.export.solved import Touch, TouchPoint
from handeye.report import gather_recording, gather_result, html_page
from handeye.report.touch_picture import touch_picture
from handeye.types import Mounting
from handeye.types.calibration import ModelName
from handeye.types.touch import WorkBox
from pages import gathered_cell, opened_cell

POINTS = (((0.0, 0.0, 50.0), 1.0), ((100.0, 0.0, 50.0), 4.0), ((100.0, 30.0, 90.0), 2.0))
TOUCH = Touch(
    mean_mm=1.0,
    worst_mm=4.0,
    worst_at_mm=[100.0, 0.0, 50.0],
    as_reported_mm=1.0,
    box_mm=[[0.0, 0.0, 50.0], [100.0, 30.0, 90.0]],
    box_stated=True,
    tool_mm=[0.0, 0.0, 150.0],
    depth="size",
    limits={"arm": 0.7, "camera": 0.2},
    advice="",
    out_of_reach=3,
    out_of_sight=0,
    map=[TouchPoint(list(point), radius) for point, radius in POINTS],
)


def test_points_are_at_their_places() -> None:
    root = ET.fromstring(touch_picture(TOUCH))
    at = {
        one.text: (float(one.attrib["x"]), float(one.attrib["y"]))
        for one in root.iter("{http://www.w3.org/2000/svg}text")
    }
    assert {"at z = 50 mm", "at z = 90 mm"} <= set(at)
    near, far, high = at["1.0"], at["4.0"], at["2.0"]
    assert near[0] < far[0] < high[0]  # x to the right, heights one after the other
    assert near[1] == far[1] > high[1]  # y upwards


@pytest.mark.parametrize("mounting", list(Mounting))
def test_the_page_has_the_map(mounting: Mounting) -> None:
    gathered = gathered_cell(mounting)
    assert gathered.numbers.touch is not None
    page = html_page(gathered)
    assert "How far off the tool lands" in page
    assert 'aria-label="Touch error over the box of work, by height"' in page


def test_a_result_keeps_the_map_of_its_box(tmp_path: Path) -> None:
    opened = opened_cell()
    work = Work(WorkBox((0.3, -0.2, 0.0), (0.6, 0.2, 0.2)), (0.0, 0.0, 0.1))
    path = tmp_path / "result.json"
    path.write_text(json.dumps(solve(opened.recording, work=work).to_dict()))
    told = gather_result(path, command="x").numbers.touch
    assert told == gather_recording(opened, ModelName.AUTO, command="x", work=work).numbers.touch
    assert told is not None
    assert told.tool_mm == [0.0, 0.0, 100.0]
    path.write_text(json.dumps(solve(opened.recording).to_dict()))
    without = gather_result(path, command="x")
    assert without.numbers.touch is None
    assert "How far off the tool lands" not in html_page(without)


def test_report_takes_a_box_of_work(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(opened_cell().recording, tmp_path / "cell")
    box = ("--work-box-mm", "300", "-200", "0", "600", "200", "200")
    page = tmp_path / "page.html"
    found = handeye.json("report", folder, "--output", page, *box, "--tool-mm", "0", "0", "90")
    assert found["touch"]["box_mm"] == [[300.0, -200.0, 0.0], [600.0, 200.0, 200.0]]
    assert "--work-box-mm 300 -200 0 600 200 200 --tool-mm 0 0 90" in found["recipe"]["command"]
    result = tmp_path / "result.json"
    handeye.json("solve", folder, "--output", result)
    assert handeye.fails("report", result, "--output", page, *box)["exit_code"] == 2
