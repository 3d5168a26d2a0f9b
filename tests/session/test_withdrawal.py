"""Taking a view back: it stays in the journal, and counts no more, also after a break."""

from pathlib import Path

import pytest

from handeye.errors import InputError
from handeye.importing import open_folder
from handeye.report.history import attempts
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.deciding import EndReason, Step
from handeye.session.entry import Failure, views_of
from handeye.session.loop import Session
from handeye.session.store import open_session
from sessions import configured


def taken(session: Session, count: int) -> None:
    for _ in range(count):
        step = session.next()
        assert isinstance(step, Step)
        session.take(step)


def test_a_withdrawn_view_is_gone_from_the_recording_and_from_decisions(tmp_path: Path) -> None:
    session, store = begin(prepare(configured(3)), tmp_path / "s")
    taken(session, 4)
    before = session.next()
    entry = session.withdraw("view_02", "a hand in the picture")
    assert (entry.failure, entry.withdraws, entry.view) == (Failure.WITHDRAWN, "view_02", None)
    assert [view.name for view in session.views] == ["view_01", "view_03", "view_04"]
    assert [view.name for view in store.recording.views] == ["view_01", "view_03", "view_04"]
    after = session.next()
    assert isinstance(before, Step)
    assert isinstance(after, Step)
    # The next view has a new name, and what is believed is believed from three views.
    assert after.goal.label == before.goal.label == "view_05.1"
    assert after.estimate is not None
    assert before.estimate is not None
    assert after.estimate.entropy > before.estimate.entropy
    with pytest.raises(InputError, match="no view of this session"):
        session.withdraw("view_02", "once more")
    store.close()
    assert [view.name for view in open_folder(tmp_path / "s").recording.views] == [
        "view_01",
        "view_03",
        "view_04",
    ]
    assert [a.failure for a in attempts(tmp_path / "s")] == ["withdrawn"]


def test_a_session_with_a_withdrawn_view_goes_on_alike_after_a_break(tmp_path: Path) -> None:
    session, store = begin(prepare(configured(3)), tmp_path / "s")
    taken(session, 4)
    session.withdraw("view_04", "undone")
    expected = session.next()
    store.close()
    again, store, _ = go_on(tmp_path / "s")
    found = again.next()
    store.close()
    assert isinstance(expected, Step)
    assert isinstance(found, Step)
    assert found.goal.T_base_flange == expected.goal.T_base_flange


def test_a_recording_that_still_has_the_view_is_brought_up_to_date(tmp_path: Path) -> None:
    session, store = begin(prepare(configured(3)), tmp_path / "s")
    taken(session, 3)
    kept = (tmp_path / "s" / "recording.toml").read_bytes()
    session.withdraw("view_03", "undone")
    store.close()
    # As after a crash between the journal and the recording.
    (tmp_path / "s" / "recording.toml").write_bytes(kept)
    store = open_session(tmp_path / "s")
    assert [view.name for view in store.recording.views] == ["view_01", "view_02"]
    assert len(views_of(store.entries)) == 2
    store.close()


def test_a_session_ends_by_hand_with_its_answer(tmp_path: Path) -> None:
    session, store = begin(prepare(configured(3)), tmp_path / "s")
    taken(session, 5)
    end = session.end()
    store.close()
    assert end.reason is EndReason.BY_HAND
    assert end.calibration is not None
    assert end.estimate is not None
    assert end.views == 5
