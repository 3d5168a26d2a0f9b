"""Pictures show what they say."""

import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from handeye.report.canvas import Canvas
from handeye.report.curve_picture import curve_picture
from handeye.report.projection import outlook_on
from handeye.report.residual_pictures import residual_tiles
from handeye.report.scene_picture import cell_picture, mount_picture, views_picture
from handeye.report.views import ViewPicture
from handeye.types import Mounting
from pages import gathered_cell

SVG = "{http://www.w3.org/2000/svg}"


def parsed(svg: str) -> ET.Element:
    root = ET.fromstring(svg)
    assert root.tag == f"{SVG}svg"
    assert root.get("role") == "img"
    assert root.get("aria-label")
    return root


def test_words_are_escaped() -> None:
    canvas = Canvas(10, 10, '"<a>&')
    canvas.text(1, 2, "<script>&</script>")
    root = parsed(canvas.markup())
    assert root.get("aria-label") == '"<a>&'
    assert [text.text for text in root.iter(f"{SVG}text")] == ["<script>&</script>"]


def test_segments_end_where_they_should() -> None:
    canvas = Canvas(100, 100, "x")
    starts = np.array([[1.234567, 2.0], [30.0, 40.0]])
    ends = np.array([[5.0, 7.5], [29.994, 41.001]])
    canvas.segments(starts, ends, 'stroke="red"')
    (path,) = parsed(canvas.markup()).iter(f"{SVG}path")
    drawn = np.array(re.findall(r"M(\S+) ([^l]+)l(\S+) ([^M]+)", str(path.get("d"))), dtype=float)
    np.testing.assert_allclose(drawn[:, :2], starts, atol=0.006)
    np.testing.assert_allclose(drawn[:, :2] + drawn[:, 2:], ends, atol=0.011)


def test_outlook_fits_and_keeps_up_upwards() -> None:
    points = np.random.default_rng(1).uniform(-1, 1, size=(50, 3)) * [2, 1, 0.5]
    outlook = outlook_on(points, 300, 200, 20)
    places = outlook(points)
    assert (places >= 20 - 1e-9).all()
    assert (places <= np.array([300, 200]) - 20 + 1e-9).all()
    below, above = outlook(np.array([[0.0, 0, 0], [0, 0, 1]]))
    assert above[1] < below[1]
    assert above[0] == pytest.approx(below[0])


@pytest.mark.parametrize("mounting", Mounting)
def test_scenes_are_drawn_within_the_picture(mounting: Mounting) -> None:
    gathered = gathered_cell(mounting)
    for svg in (
        cell_picture(gathered.scene),
        views_picture(gathered.scene),
        mount_picture(gathered.scene, gathered.numbers.answer),
    ):
        root = parsed(svg)
        width, height = (float(side) for side in str(root.get("viewBox")).split()[2:])
        for path in root.iter(f"{SVG}path"):
            places = np.array(re.findall(r"-?[\d.]+", str(path.get("d"))), dtype=float).reshape(-1, 2)
            assert (places >= 0).all()
            assert (places <= [width, height]).all()
    words = [
        text.text
        for text in parsed(mount_picture(gathered.scene, gathered.numbers.answer)).iter(f"{SVG}text")
    ]
    assert {"camera", gathered.numbers.answer.parent} <= set(words)
    numbers = [text.text for text in parsed(views_picture(gathered.scene)).iter(f"{SVG}text")]
    assert {str(number) for number in range(1, 9)} <= set(numbers)


def test_arrows_go_from_predicted_to_found_on_one_scale() -> None:
    pixels = np.array([[100.0, 100], [300, 200], [500, 300], [200, 400]])
    residuals = np.array([[1.0, 0], [0, 1.0], [-1.0, 0], [0, -1.0]])
    pictures = [
        ViewPicture(name, 640, 480, pixels, factor * residuals) for name, factor in (("a", 1.0), ("b", 0.5))
    ]
    tiles = residual_tiles(pictures, frozenset())
    # No part of the image has enough points for a mean.
    assert [tile.title for tile in tiles.tiles] == ["a", "b"]
    lengths = []
    for tile in tiles.tiles:
        path = next(p for p in parsed(tile.svg).iter(f"{SVG}path") if "l" in str(p.get("d")))
        drawn = np.array(re.findall(r"M(\S+) ([^l]+)l(\S+) ([^M]+)", str(path.get("d"))), dtype=float)
        steps = drawn[:, 2:]
        np.testing.assert_allclose(steps / np.linalg.norm(steps, axis=1)[:, None], residuals, atol=0.02)
        factor = 1.0 if tile.title == "a" else 0.5
        np.testing.assert_allclose(drawn[:, :2], (pixels - factor * residuals + 0.5) * 240 / 640, atol=0.01)
        lengths.append(np.linalg.norm(steps, axis=1).mean())
    assert lengths[0] == pytest.approx(2 * lengths[1], rel=0.01)
    assert "1 px" in tiles.scale


def test_views_left_out_are_named_and_do_not_count() -> None:
    pixels = np.random.default_rng(2).uniform(0, 480, size=(400, 2))
    good = ViewPicture("good", 640, 480, pixels, np.full((400, 2), 0.1 / np.sqrt(2)))
    wild = ViewPicture("wild", 640, 480, pixels, np.full((400, 2), 90.0))
    tiles = residual_tiles([good, wild], frozenset({"wild"}))
    assert "left out" in tiles.tiles[2].note
    assert "0.1 px" in tiles.scale
    assert "0.10" in tiles.tiles[0].note


def test_no_points_no_pictures() -> None:
    nothing = ViewPicture("a", 640, 480, np.zeros((0, 2)), np.zeros((0, 2)))
    assert residual_tiles([nothing], frozenset()).tiles == []


@pytest.mark.parametrize(
    "values", [[5.0, 2.0, 1.0], [1.0, 1.0, 1.0], [300.0, 1e-3, 1e-6], [0.0471, 0.0470, 0.0469]]
)
@pytest.mark.parametrize("asked", [None, 0.5])
def test_curves_lie_in_the_picture_and_fall_where_they_fall(values: list[float], asked: float | None) -> None:
    root = parsed(curve_picture([3, 5, 9], values, "mm", "position", asked))
    curve = next(p for p in root.iter(f"{SVG}path") if p.get("stroke-linejoin") == "round")
    places = np.array(re.findall(r"-?[\d.]+", str(curve.get("d"))), dtype=float).reshape(-1, 2)
    assert (places >= 0).all()
    assert (places <= [350, 210]).all()
    assert (np.diff(places[:, 0]) > 0).all()
    assert (np.sign(np.diff(places[:, 1])) == -np.sign(np.diff(values))).all() or np.ptp(values) < 1e-3
    asked_for = [text.text for text in root.iter(f"{SVG}text") if str(text.text).startswith("asked")]
    assert asked_for == ([] if asked is None else ["asked 0.50 mm"])
