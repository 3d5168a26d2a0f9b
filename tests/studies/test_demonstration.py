"""The demonstration: paired starts, honest numbers, a sentence that the numbers decide."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.errors import InputError
from handeye.studies.comparison import POLICIES
from handeye.studies.demonstration import WAYS, Curve, Demonstration, Way, demonstrate
from handeye.studies.demonstration_picture import demonstration_figure
from handeye.types import Recording
from handeye.types.calibration import ModelName


@pytest.fixture(scope="module")
def recording() -> Recording:
    return read_recording(shipped_recording()).recording


@pytest.fixture(scope="module")
def shown(recording: Recording) -> Demonstration:
    return demonstrate(recording, starts=4)


def test_shipped_recording_cites_its_source_and_has_no_pictures(recording: Recording) -> None:
    assert "Sensors 19(12), 2837, 2019" in recording.source
    assert len(recording) == 30
    assert all(view.image is None for view in recording.views)
    assert recording.truth is not None
    size = sum(path.stat().st_size for path in shipped_recording().rglob("*") if path.is_file())
    assert size < 1_500_000


def test_starts_are_paired(shown: Demonstration) -> None:
    starts = [shown.curves[Way(policy)].translation_mm[:, 0] for policy in POLICIES]
    np.testing.assert_array_equal(starts[0], starts[1])
    np.testing.assert_array_equal(starts[0], starts[2])
    assert shown.views == (3, 4, 5, 6, 7, 8)
    assert all(curve.translation_mm.shape == (4, 6) for curve in shown.curves.values())


def test_views_help_and_the_answer_knows_it(shown: Demonstration) -> None:
    chosen = shown.curves[Way("next_best_view")]
    assert chosen.translation_mm[:, -1].max() < 1
    assert chosen.translation_mm[:, -1].mean() < 0.5 * chosen.translation_mm[:, 0].mean()
    ratio = chosen.translation_mm / chosen.sigma_translation_mm
    assert 0.3 < np.sqrt(np.mean(np.square(ratio))) < 3


def test_same_with_more_workers(recording: Recording, shown: Demonstration) -> None:
    again = demonstrate(recording, starts=4, workers=2)
    assert again.to_dict() == shown.to_dict()


def test_progress(recording: Recording) -> None:
    steps: list[tuple[int, int]] = []
    demonstrate(recording, starts=1, added_views=1, progress=lambda done, total: steps.append((done, total)))
    assert steps[-1] == (1, 1)


def with_finals(shown: Demonstration, finals: dict[str, float]) -> Demonstration:
    """The demonstration with invented errors: they fall by one part in six with each view."""
    curves: dict[Way, Curve] = {}
    for way in WAYS:
        last = finals[way.policy] if way.model is ModelName.AUTO else 1.0
        values = np.tile(last * np.linspace(6, 1, 6), (4, 1))
        curves[way] = Curve(way, values, values, values)
    return replace(shown, curves=curves)


def test_sentence_says_who_is_best(shown: Demonstration) -> None:
    sentence = with_finals(shown, {"next_best_view": 0.1, "random": 0.32, "max_distance": 0.2}).sentence
    assert sentence == (
        "After 3 + 5 views, views chosen for their gain leave the camera 0.1 mm off on average, the most distant "
        "views 0.2 mm and random views 0.32 mm; 3 of the former are worth 5 random ones."
    )
    lost = with_finals(shown, {"next_best_view": 0.3, "random": 0.1, "max_distance": 0.2}).sentence
    assert lost.startswith("After 3 + 5 views, random views leave the camera 0.1 mm off on average")
    assert "worth" not in lost


def test_recording_without_truth(recording: Recording) -> None:
    with pytest.raises(InputError) as caught:
        demonstrate(replace(recording, truth=None))
    assert caught.value.code == "no_truth"


def test_figure_shows_every_way(shown: Demonstration) -> None:
    figure = demonstration_figure(shown)
    words = " ".join(text.get_text() for text in figure.axes[0].texts)
    for name in ("next best view", "random", "max distance", "paper's model"):
        assert name in words
    figure.canvas.draw()
