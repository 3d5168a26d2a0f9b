"""A session survives any end of its process: nothing is lost, nothing doubled, and the result is the same."""

import errno
import json
import os
import time
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import InputError, OutputError
from handeye.session import store as store_module
from handeye.session.attempt import Cell
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.deciding import EndReason
from handeye.session.entry import Entry
from handeye.session.faults import FaultRates
from handeye.session.observer import Observer
from handeye.session.store import create_session, open_session
from sessions import Outcome, configured, run, run_killed

pytestmark = pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_killed_at_any_instant_it_ends_as_if_undisturbed(tmp_path: Path) -> None:
    faults = FaultRates(refused=0.1, not_found=0.15)
    configuration = configured(3, faults=faults)
    began = time.monotonic()
    run(configuration, tmp_path / "undisturbed")
    took_s = time.monotonic() - began
    undisturbed = Outcome.of(tmp_path / "undisturbed")
    assert any("failure" in entry for entry in undisturbed.journal)
    kills = run_killed(configuration, tmp_path / "killed", np.random.default_rng(1), took_s / 8)
    assert kills >= 3
    assert Outcome.of(tmp_path / "killed") == undisturbed


def test_killed_between_any_two_writes_it_ends_as_if_undisturbed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Every place where the process can die on the way of one view to the disk, one after the other.
    configuration = configured(1, blur_px=0.0)
    run(configuration, tmp_path / "undisturbed")
    undisturbed = Outcome.of(tmp_path / "undisturbed")

    class Killed(BaseException):
        pass

    folder = tmp_path / "broken"
    session, store = begin(prepare(configuration), folder)
    store.close()
    for number in range(40):
        session, store, _ = go_on(folder)
        fsync, left = os.fsync, [number % 7]

        def dying(descriptor: int, fsync: object = fsync, left: list[int] = left) -> None:
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            assert callable(fsync)
            fsync(descriptor)

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", dying)
            try:
                session.run()
            except Killed:
                continue
            finally:
                store.close()
        break
    run(configuration, folder)
    assert Outcome.of(folder) == undisturbed


def test_edited_or_foreign_files_are_refused_in_words(tmp_path: Path) -> None:
    run(configured(2, most_views=4), tmp_path / "a")
    journal, settings = tmp_path / "a" / "journal.jsonl", tmp_path / "a" / "session.json"
    good, said = journal.read_bytes(), settings.read_bytes()
    lines = good.splitlines(keepends=True)
    escaping = json.loads(lines[0])
    escaping["view"]["image"] = "../../etc/passwd"
    for bad in (
        b"".join(lines[1:]),
        b"".join([lines[0], lines[0], *lines[1:]]),
        b"{}\n",
        b"[" * 100_000 + b"\n",
        b"\xff\xfe\n",
        json.dumps(escaping).encode() + b"\n",
        good.replace(b'"moved":true', b'"moved":3', 1),
    ):
        journal.write_bytes(bad)
        with pytest.raises(InputError):
            open_session(tmp_path / "a")
    journal.write_bytes(good)
    for text in (
        "",
        "[]",
        '{"format": "x"}',
        '{"format": "handeye-session", "version": 3}',
        said[:-30].decode(),
    ):
        settings.write_text(text)
        with pytest.raises(InputError):
            open_session(tmp_path / "a")
    settings.write_bytes(said)
    open_session(tmp_path / "a").close()


def test_two_processes_do_not_write_one_session(tmp_path: Path) -> None:
    prepared = prepare(configured(0))
    store = create_session(tmp_path / "a", prepared.recording, {})
    with pytest.raises(InputError, match="another process"):
        open_session(tmp_path / "a")
    store.close()
    open_session(tmp_path / "a").close()
    with pytest.raises(OutputError, match="not empty"):
        create_session(tmp_path / "a", prepared.recording, {})


def test_a_full_disk_is_waited_for_and_then_a_clear_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("handeye.session.taking._WRITE_PAUSE_S", 0.0)
    append, full = store_module.SessionStore.append, [2]

    def appending(self: store_module.SessionStore, entry: Entry) -> None:
        if full[0] > 0 and entry.number == 2:
            full[0] -= 1
            raise OutputError(os.strerror(errno.ENOSPC))
        append(self, entry)

    with monkeypatch.context() as patch:
        patch.setattr(store_module.SessionStore, "append", appending)
        assert run(configured(2, most_views=4), tmp_path / "a").views == 4
        full[0] = 9
        with pytest.raises(OutputError):
            run(configured(2, most_views=4), tmp_path / "b")
    assert run(configured(2, most_views=4), tmp_path / "b").views == 4
    assert Outcome.of(tmp_path / "a") == Outcome.of(tmp_path / "b")


def test_an_interruption_stops_the_arm_and_leaves_the_session_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped: list[bool] = []
    monkeypatch.setattr(Cell, "stop", lambda _: stopped.append(True))
    configuration = configured(2)

    class Interrupting(Observer):
        def taken(self, entry: Entry, estimate: object) -> None:
            if entry.number == 4:
                raise KeyboardInterrupt

    session, store = begin(prepare(configuration, observer=Interrupting()), tmp_path / "a")
    with pytest.raises(KeyboardInterrupt):
        session.run()
    store.close()
    # Once to see before the first motion that it can be stopped, once as it was interrupted.
    assert stopped == [True, True]
    assert run(configuration, tmp_path / "a").reason is EndReason.ACCURACY_REACHED
    run(configuration, tmp_path / "b")
    assert Outcome.of(tmp_path / "a") == Outcome.of(tmp_path / "b")
