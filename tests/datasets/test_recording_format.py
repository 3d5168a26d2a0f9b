"""Our recording on disk: it reads back to the last bit, and every fault is named."""

import os
import re
import secrets
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given

from datasets.layouts import SIZE, everything_below, names_in, png, some_recording
from handeye.datasets import check_written, read_recording, write_recording
from handeye.errors import InputError, OutputError
from handeye.types import Mounting, Recording, View
from strategies import recordings


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A recording with images."""
    for k in range(3):
        png(tmp_path / "camera" / "pictures" / f"{k}.png")
    write_recording(some_recording(images=True), tmp_path / "rec", images_from=tmp_path / "camera")
    return tmp_path / "rec"


@given(recordings())
def test_what_is_written_reads_back_to_the_last_bit(tmp_path: Path, recording: Recording) -> None:
    folder = tmp_path / secrets.token_hex(8)
    write_recording(recording, folder)
    assert read_recording(folder).recording == recording


def test_the_file_is_toml_that_a_person_can_read(folder: Path) -> None:
    text = (folder / "recording.toml").read_text()
    document = tomllib.loads(text)
    assert document["format"] == "handeye-recording"
    assert document["version"] == 1
    assert document["truth"].keys() == {"T_camera_flange"}
    assert [view["corners"] for view in document["view"]] == [f"corners/im_{k}.csv" for k in range(3)]
    assert max(map(len, text.splitlines())) < 120
    assert (folder / "corners" / "im_2.csv").read_text().startswith("id,u_px,v_px\n2,")


def test_deviations_of_points_are_one_more_column_that_may_be_missing(folder: Path) -> None:
    file = folder / "corners" / "im_0.csv"
    plain = file.read_text()
    assert read_recording(folder).recording.views[0].sigmas_px is None
    rows = plain.splitlines()
    file.write_text(
        "\n".join([f"{rows[0]},sigma_px", *(f"{row},0.0{k + 1}" for k, row in enumerate(rows[1:]))])
    )
    view = read_recording(folder).recording.views[0]
    assert view.sigmas_px is not None
    assert view.sigmas_px[:2].tolist() == [0.01, 0.02]
    file.write_text("\n".join([f"{rows[0]},sigma_px", *(f"{row},0" for row in rows[1:])]))
    with pytest.raises(InputError, match=r"im_0: sigmas_px: 0, expected numbers above zero"):
        read_recording(folder)
    file.write_text("\n".join([f"{rows[0]},sigma_px", *rows[1:]]))
    with pytest.raises(InputError, match="line 2: 3 values, expected id,u_px,v_px,sigma_px"):
        read_recording(folder)


def test_images_are_copied_and_found_again(folder: Path, tmp_path: Path) -> None:
    loaded = read_recording(folder)
    path = loaded.image_path(loaded.recording.views[1])
    assert path == folder / "images" / "im_1.png"
    assert path.read_bytes() == (tmp_path / "camera" / "pictures" / "1.png").read_bytes()
    write_recording(loaded.recording, tmp_path / "without")
    bare = read_recording(tmp_path / "without")
    assert bare.image_path(bare.recording.views[1]) is None


def test_the_truth_has_the_names_of_its_mounting(tmp_path: Path) -> None:
    recording = some_recording()
    hand = Recording(**{**vars(recording), "mounting": Mounting.EYE_TO_HAND})
    write_recording(hand, tmp_path / "rec")
    assert "T_camera_base = [" in (tmp_path / "rec" / "recording.toml").read_text()
    assert read_recording(tmp_path / "rec").recording == hand


def edit(file: Path, pattern: str, replacement: str) -> None:
    text = file.read_text()
    edited, count = re.subn(pattern, lambda _: replacement, text, count=1, flags=re.DOTALL)
    assert count == 1
    assert edited != text
    file.write_text(edited)


def toml(pattern: str, replacement: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "recording.toml", pattern, replacement)


def first(matrix: str, number: str) -> Callable[[Path], None]:
    """Change the first number of the first matrix of a name, or leave it out."""
    return toml(rf"(?<={matrix} = \[\n  \[)[^,]*{'' if number else ', '}", number)


def text(name: str, content: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(content)


def corners(pattern: str, replacement: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "corners" / "im_1.csv", pattern, replacement)


def link_out(folder: Path) -> None:
    (folder / "corners" / "im_1.csv").rename(folder.parent / "elsewhere.csv")
    (folder / "corners" / "im_1.csv").symlink_to(folder.parent / "elsewhere.csv")


def link_folder_out(folder: Path) -> None:
    (folder / "images").rename(folder.parent / "elsewhere")
    (folder / "images").symlink_to(folder.parent / "elsewhere", target_is_directory=True)


def link_in_a_circle(folder: Path) -> None:
    (folder / "corners" / "im_1.csv").unlink()
    (folder / "corners" / "im_1.csv").symlink_to("im_1.csv")


def pipe(folder: Path) -> None:
    (folder / "corners" / "im_1.csv").unlink()
    os.mkfifo(folder / "corners" / "im_1.csv")


def directory(folder: Path) -> None:
    (folder / "corners" / "im_1.csv").unlink()
    (folder / "corners" / "im_1.csv").mkdir()


def giant(name: str) -> Callable[[Path], None]:
    def grow(folder: Path) -> None:
        os.truncate(folder / name, 1 << 40)  # a hole, not a terabyte

    return grow


def cut_image(folder: Path) -> None:
    path = folder / "images" / "im_1.png"
    path.write_bytes(path.read_bytes()[:-20])


FAULTS: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "no recording.toml": (lambda f: (f / "recording.toml").unlink(), "missing_file", "recording.toml"),
    "empty": (text("recording.toml", ""), "unknown_format", "recording.toml"),
    "no toml": (toml(r"\[camera\]", "[camera"), "not_toml", "line"),
    "nested": (text("recording.toml", "a = " + "[" * 50_000), "not_toml", "recording.toml"),
    "a key of many parts": (text("recording.toml", "a." * 30_000 + "a = 1"), "not_toml", "dots"),
    "cut off after a view": (toml(r"\[\[view\]\]\nname = \"im_2\".*", ""), "truncated", "2 views, but view_count is 3"),
    "no text": (lambda f: (f / "recording.toml").write_bytes(b"a = '\xff'"), "not_text", "byte 5"),
    "another format": (toml('"handeye-recording"', '"bag"'), "unknown_format", "'bag'"),
    "a newer version": (toml("version = 1", "version = 3"), "newer_version", "version 3"),
    "no version": (toml("version = 1", "version = true"), "invalid_field", "version"),
    "an unknown field": (toml("mounting = ", "colour = 1\nmounting = "), "invalid_field", "colour"),
    "an unknown mounting": (toml('"eye_in_hand"', '"eye_on_hand"'), "invalid_field", "mounting"),
    "an unknown lens": (toml("brown_conrady_5", "brown_conrady_6"), "unknown_lens", "brown_conrady_6"),
    "an unknown target": (toml("chessboard", "checkers"), "unknown_target", "checkers"),
    "millimetres by name": (toml("pitch_m", "pitch_mm"), "invalid_field", "pitch_mm"),
    "NaN in a pose": (first("T_base_flange", "nan"), "not_finite", "view im_0: T_base_flange"),
    "half a row in a pose": (first("T_base_flange", ""), "not_numbers", "view im_0: T_base_flange"),
    "a pose that is not rigid": (first("T_base_flange", "2.0"), "not_rigid", "view im_0: T_base_flange"),
    "a truth of another mounting": (toml("T_camera_flange", "T_other"), "invalid_field", "T_other"),
    "a truth that is not rigid": (first("T_camera_flange", "2.0"), "not_rigid", "T_camera_flange"),
    "a view twice": (toml('name = "im_1"', 'name = "im_0"'), "duplicate_view", "im_0"),
    "a name that leaves": (toml('name = "im_1"', 'name = "../im_1"'), "invalid_name", "../im_1"),
    "a path up": (toml('"corners/im_1.csv"', '"../rec/a.csv"'), "path_outside", "view im_1: corners"),
    "an absolute path": (toml('"corners/im_1.csv"', '"/etc/passwd"'), "path_outside", "view im_1: corners"),
    "an image outside": (toml('"images/im_1.png"', '"../1.png"'), "path_outside", "view im_1: image"),
    "a link out": (link_out, "path_outside", "view im_1: corners"),
    "a folder that is a link out": (link_folder_out, "path_outside", "view im_0: image"),
    "links in a circle": (link_in_a_circle, "unreadable", "view im_1: corners"),
    "a pipe": (pipe, "unreadable", "im_1.csv"),
    "a folder for a file": (directory, "unreadable", "im_1.csv"),
    "no corners": (lambda f: (f / "corners" / "im_1.csv").unlink(), "missing_file", "view im_1: corners"),
    "no image": (lambda f: (f / "images" / "im_1.png").unlink(), "missing_file", "view im_1: image"),
    "a truncated image": (cut_image, "truncated_image", "im_1.png"),
    "an image of another size": (lambda f: png(f / "images" / "im_1.png", (32, 48)), "image_size", "32 x 48"),
    "a text for an image": (text("images/im_1.png", "no"), "not_an_image", "im_1.png"),
    "a giant recording.toml": (giant("recording.toml"), "too_large", "recording.toml"),
    "giant corners": (giant("corners/im_1.csv"), "too_large", "im_1.csv"),
    "another header": (corners("id,u_px,v_px", "id,x,y"), "invalid_field", "line 1"),
    "empty corners": (text("corners/im_1.csv", ""), "invalid_field", "line 1"),
    "header only": (text("corners/im_1.csv", "id,u_px,v_px\n"), "no_points", "im_1"),
    "cut in a line": (corners(r"(?<=\n2),[^\n]*\n.*", ""), "wrong_shape", "line 3"),
    "a point the target does not have": (corners("\n11,", "\n12,"), "point_out_of_range", "point 12"),
    "a point twice": (corners("\n11,", "\n10,"), "duplicate_point", "point 10"),
    "a negative point": (corners("\n11,", "\n-1,"), "not_numbers", "line 12"),
    "half a point": (corners("\n11,", "\n10.5,"), "not_numbers", "line 12"),
    "NaN in corners": (corners(r"(?<=\n11,)[^,]*", "nan"), "not_finite", "line 12: u_px"),
    "infinity in corners": (corners(r"(?<=\n11,)[^,]*", "1e999"), "not_finite|not_numbers", "line 12: u_px"),
    "words in corners": (corners(r"(?<=\n11,)[^,]*", "left"), "not_numbers", "line 12: u_px"),
    "a pixel far outside": (corners(r"(?<=\n11,)[^,]*", "1000"), "pixel_outside", "view im_1"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_has_its_error_that_names_the_place(folder: Path, fault: str) -> None:
    damage, code, place = FAULTS[fault]
    damage(folder)
    with pytest.raises(InputError) as caught:
        read_recording(folder)
    assert re.fullmatch(code, caught.value.code)
    assert place in caught.value.message


def test_a_link_inside_the_folder_is_fine(folder: Path) -> None:
    before = read_recording(folder).recording
    (folder / "corners" / "im_1.csv").rename(folder / "elsewhere.csv")
    (folder / "corners" / "im_1.csv").symlink_to("../elsewhere.csv")
    assert read_recording(folder).recording == before


def test_an_existing_recording_is_not_overwritten_unasked(folder: Path) -> None:
    before = everything_below(folder)
    with pytest.raises(OutputError) as caught:
        write_recording(some_recording(1), folder)
    assert caught.value.code == "exists"
    assert everything_below(folder) == before


def test_what_is_no_recording_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    for content in (None, "broken = "):
        if content is not None:
            (tmp_path / "recording.toml").write_text(content)
        before = everything_below(tmp_path)
        with pytest.raises(OutputError):
            write_recording(some_recording(1), tmp_path, replace=True)
        assert everything_below(tmp_path) == before


def test_a_missing_image_is_named_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "camera").mkdir()
    with pytest.raises(OutputError, match=r"pictures/0\.png"):
        write_recording(some_recording(images=True), tmp_path / "rec", images_from=tmp_path / "camera")
    assert names_in(tmp_path) == ["camera"]


def test_views_are_added_removed_and_changed(folder: Path) -> None:
    whole = read_recording(folder).recording
    middle = whole.views[1]
    changed = View("im_1", middle.T_base_flange, [0, 1, 2], middle.pixels[:3], middle.image)
    added = View("new", whole.views[0].T_base_flange, [4, 5], [[1, 2], [3, 4]])
    second = whole.with_views([whole.views[0], changed, added])
    write_recording(second, folder, images_from=folder, replace=True)
    assert read_recording(folder).recording == second
    files = set(everything_below(folder))
    assert files == {
        "recording.toml",
        "corners/im_0.csv",
        "corners/im_1.2.csv",
        "corners/new.csv",
        "images/im_0.png",
        "images/im_1.png",
        "images/im_2.png",  # images are never removed
    }
    write_recording(second, folder, replace=True)
    assert read_recording(folder).recording == second
    assert set(everything_below(folder)) == files


def test_plausible_millimetres_are_a_warning(folder: Path) -> None:
    assert read_recording(folder).warnings == ()
    edit(folder / "recording.toml", "pitch_m = 0.02", "pitch_m = 20.0")
    loaded = read_recording(folder)
    assert {warning.code for warning in loaded.warnings} >= {"target_not_metres"}
    assert loaded.recording.camera.size_px == SIZE


def test_what_was_written_is_compared(tmp_path: Path) -> None:
    recording = some_recording()
    write_recording(recording, tmp_path / "set")
    check_written(recording, tmp_path / "set")
    with pytest.raises(OutputError, match="does not read back as it was written"):
        check_written(recording.select(["im_0", "im_1"]), tmp_path / "set")
    corners = tmp_path / "set" / "corners" / "im_1.csv"
    corners.write_text(corners.read_text().replace(".", ".1", 1))
    with pytest.raises(OutputError, match="does not read back as it was written"):
        check_written(recording, tmp_path / "set")
    corners.unlink()
    with pytest.raises(OutputError, match="does not read back"):
        check_written(recording, tmp_path / "set")
