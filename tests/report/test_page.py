"""The page: complete, self-contained, and safe whatever the names in the data."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.estimation import solve
from handeye.report import Gathered, gather_recording, gather_result, html_page
from handeye.report.document import Attempt, Request
from handeye.types import Mounting
from handeye.types.calibration import ModelName
from pages import gathered_cell, opened_cell

VOID = {"meta", "br", "hr", "img", "link", "input"}
HOSTILE = '"><script>alert(1)</script><img src=//evil.example/x onerror=alert(1)>&amp;</style></pre>'
# Whatever makes a browser ask for something.
ASKING = {
    "src",
    "href",
    "srcset",
    "data",
    "action",
    "poster",
    "background",
    "xlink:href",
    "ping",
    "formaction",
}


class Reader(HTMLParser):
    """Reads a page: its tags balanced, its attributes and words collected."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.words: list[str] = []
        self.feed(page)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def check_alone(page: str) -> Reader:
    """The page asks nobody for anything and runs nothing."""
    reader = Reader(page)
    assert not {"script", "iframe", "object", "embed", "link", "img", "form", "base", "video", "audio"} & set(
        reader.tags
    )
    names = {name for name, _ in reader.attributes}
    assert not names & ASKING
    assert not [name for name in names if name.startswith("on")]
    (style,) = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    assert "url(" not in style
    assert "@import" not in style
    policy = next(value for name, value in reader.attributes if name == "content" and "default-src" in value)
    assert policy == "default-src 'none'; style-src 'unsafe-inline'"
    return reader


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("model", ModelName)
def test_page_says_what_there_is_to_say(mounting: Mounting, model: ModelName) -> None:
    gathered = gathered_cell(mounting, model, spoiled=True, missed={"dark_01": "target not found: too dark"})
    page = html_page(gathered)
    reader = check_alone(page)
    parent = "flange" if mounting is Mounting.EYE_IN_HAND else "base"
    for said in (
        f"position of the camera in the frame of the {parent}",
        f"T_{parent}_camera",
        "8 of 10 views used",
        "spoiled",
        "at least 4 are needed",
        "target not found: too dark",
        "knows the truth: the answer is off by",
        "handeye report cell",
        str(gathered.numbers.recipe.recording_sha256),
        "static_transform_publisher",
        "robot and camera taken as exact"
        if model is ModelName.PAPER
        else "found together, by what the views say",
    ):
        assert said in reader.text, said
    for sentence in (*gathered.numbers.warnings, *(said.sentence[1:] for said in gathered.numbers.diagnosis)):
        assert sentence in reader.text
    # Mount, touches, cell, views, two curves, scale, mean residual, and a picture for every view that could be
    # measured.
    assert (
        reader.tags.count("svg")
        == 4 + 2 * (model is ModelName.AUTO or len(gathered.numbers.curve) > 1) + 2 + 8
    )
    assert "nan" not in re.sub(r"[a-z]*nan[a-z]+", "", reader.text.lower()).split()
    assert not re.search(r'[" ,ML](nan|inf|-inf)[" ,lZ]', page)


def test_numbers_on_the_page_are_those_of_the_answer() -> None:
    gathered = gathered_cell()
    reader = Reader(html_page(gathered))
    answer = gathered.numbers.answer
    for value in answer.position_mm:
        assert f"{value:.3f} mm".replace("-", "\N{MINUS SIGN}") in reader.text
    for axis in (*answer.position_axes, *answer.rotation_axes):
        assert axis.words in reader.text
    for row in answer.T_parent_camera:
        assert " ".join(f"{value:.9f}" for value in row) in reader.text


def test_hostile_names_stay_words() -> None:
    gathered = gathered_cell(name=HOSTILE[:150], source=HOSTILE, spoiled=True, missed={HOSTILE: HOSTILE})
    gathered.numbers.warnings.append(HOSTILE)
    gathered.numbers.attempts.append(Attempt(label=HOSTILE, failure=HOSTILE, detail=HOSTILE))
    gathered.numbers.recipe.command = HOSTILE
    gathered.numbers.start = HOSTILE
    gathered.numbers.noise.evidence[HOSTILE] = 0.5
    gathered.numbers.exports["urdf"] = HOSTILE
    page = html_page(gathered)
    check_alone(page)
    assert "<script" not in page.lower()
    assert "onerror=alert(1)&gt;" in page


@settings(max_examples=15)
@given(st.text(alphabet=st.characters(exclude_categories=["Cs"]), max_size=60))
def test_any_words_stay_words(words: str) -> None:
    gathered = cached()
    gathered.numbers.warnings[:] = [words]
    gathered.numbers.source = words
    check_alone(html_page(gathered))


_CACHE: list[Gathered] = []


def cached() -> Gathered:
    if not _CACHE:
        _CACHE.append(gathered_cell())
    return _CACHE[0]


def test_request_is_answered() -> None:
    gathered = gathered_cell()
    gathered.numbers.request = Request(translation_mm=0.01, rotation_deg=0.001, met=False)
    assert "This was not reached" in Reader(html_page(gathered)).text
    gathered.numbers.request = Request(translation_mm=10.0, rotation_deg=1.0, met=True)
    assert "This was reached" in Reader(html_page(gathered)).text


def test_twenty_views_of_a_large_board_are_small_enough() -> None:
    gathered = gathered_cell(count=20)
    page = html_page(gathered)
    assert len(page.encode()) < 8_000_000 / 4
    # Denser boards do not make it larger: arrows are thinned out.
    assert page.count("<figure>") >= 21


def test_only_the_worst_of_very_many_views_are_drawn() -> None:
    gathered = gathered_cell(count=45)
    assert "Only the 40 views with the largest residuals are shown of 45" in Reader(html_page(gathered)).text


def test_result_alone_makes_a_page(tmp_path: Path) -> None:
    opened = opened_cell()
    solved = solve(opened.recording)
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"recording": "cell 7", "source": "made up", **solved.to_dict()}))
    gathered = gather_result(path, command="handeye report result.json")
    reader = check_alone(html_page(gathered))
    assert "No residual pictures" in reader.text
    assert gathered.numbers.recipe.recording_sha256 is None
    whole = gather_recording(opened, ModelName.AUTO, command="x").numbers
    assert gathered.numbers.answer.within_95 == whole.answer.within_95
    assert gathered.numbers.answer.position_axes == whole.answer.position_axes
    assert [view.rmse_px for view in gathered.numbers.views] == [view.rmse_px for view in whole.views]


@pytest.mark.parametrize("key", ["rmse_px", "noise", "model"])
def test_a_result_that_says_too_little_makes_no_page(tmp_path: Path, key: str) -> None:
    path = tmp_path / "result.json"
    told = solve(opened_cell().recording).to_dict() | {key: None if key != "model" else ""}
    path.write_text(json.dumps(told))
    with pytest.raises(InputError, match=rf"result\.json: .*{key}"):
        gather_result(path, command="handeye report result.json")


def test_open_directions_come_first() -> None:
    from folders import parallel_recording
    from handeye.importing import CameraOrigin, Opened

    opened = Opened(parallel_recording(), Path("/nonexistent"), "handeye", CameraOrigin.FILES)
    gathered = gather_recording(opened, ModelName.AUTO, command="x", reduced=True)
    text = check_alone(html_page(gathered)).text
    assert "These views do not determine the answer" in text
    assert gathered.numbers.unobservable[0].sentence in text
    assert "Cure:" in text
    assert "is known to within" not in text.split("The answer", maxsplit=1)[0]


def test_same_recording_gives_the_same_page() -> None:
    assert html_page(gathered_cell()) == html_page(gathered_cell())


def test_hash_tells_recordings_apart() -> None:
    hashes = {
        gathered.numbers.recipe.recording_sha256
        for gathered in (gathered_cell(), gathered_cell(source="elsewhere"), gathered_cell(count=9))
    }
    assert len(hashes) == 2  # where it came from changes nothing
