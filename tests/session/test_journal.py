"""The journal of a session: what was changed is refused, what was lost is made again, nothing is deleted."""

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_recording
from handeye.errors import InputError
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.faults import FaultRates
from handeye.session.journal import read_journal, read_settings
from handeye.session.store import open_session
from sessions import Outcome, configured, run


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a session of five views and a few failures."""
    folder = tmp_path_factory.mktemp("journal") / "finished"
    run(configured(3, most_views=5, faults=FaultRates(not_found=0.3, refused=0.2)), folder)
    return folder


@pytest.fixture
def session(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "s"))


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def lines_of(folder: Path) -> list[bytes]:
    return (folder / "journal.jsonl").read_bytes().splitlines(keepends=True)


def write(folder: Path, lines: list[bytes]) -> None:
    (folder / "journal.jsonl").write_bytes(b"".join(lines))


def refused(folder: Path, match: str) -> None:
    before = tree(folder)
    with pytest.raises(InputError, match=match):
        open_session(folder)
    assert tree(folder) == before


def test_a_cut_anywhere_is_mended_or_refused_and_nothing_is_deleted(session: Path) -> None:
    whole = Outcome.of(session)
    content, before = (session / "journal.jsonl").read_bytes(), tree(session)
    random = np.random.default_rng(1)
    mended = 0
    for cut in sorted({0, len(content) - 1, *random.integers(0, len(content), 60).tolist()}):
        (session / "journal.jsonl").write_bytes(content[:cut])
        try:
            open_session(session).close()
        except InputError as error:
            assert error.code == "journal_cut"
            assert {k: v for k, v in tree(session).items() if k != "journal.jsonl"} == {
                k: v for k, v in before.items() if k != "journal.jsonl"
            }
            continue
        mended += 1
        run(configured(3), session)
        assert Outcome.of(session) == whole
    assert mended > 0


def test_a_last_line_without_its_line_feed_is_whole(session: Path) -> None:
    content = (session / "journal.jsonl").read_bytes()
    (session / "journal.jsonl").write_bytes(content[:-1])
    open_session(session).close()
    assert (session / "journal.jsonl").read_bytes() == content


@pytest.mark.parametrize(
    "torn",
    [
        lambda line: line[: len(line) // 2],
        lambda line: line[: len(line) // 2] + bytes(len(line) - len(line) // 2 - 1) + b"\n",
        lambda line: bytes(len(line)),
        lambda line: bytes(60) + line[60:],
    ],
)
def test_a_torn_last_line_is_left_out_and_said(session: Path, torn: Callable[[bytes], bytes]) -> None:
    store = open_session(session)
    assert store.notice is None
    store.close()
    whole, lines = Outcome.of(session), lines_of(session)
    # As after a crash: the recording is never ahead of the journal.
    view = json.loads(lines[-1])["view"]["name"]
    (session / "corners" / f"{view}.csv").unlink()
    (session / "recording.toml").unlink()
    last = torn(lines[-1])
    write(session, [*lines[:-1], last])
    store = open_session(session)
    assert len(store.entries) == len(lines) - 1
    assert store.notice is not None
    assert f"({len(last)} bytes)" in store.notice
    store.close()
    run(configured(3), session)
    assert Outcome.of(session) == whole
    # Not the last line: that was no crash.
    write(session, [*lines[:-2], torn(lines[-2]), lines[-1]])
    with pytest.raises(InputError, match=r"does not fit its checksum|no attempt in the journal took"):
        open_session(session)


def test_changed_bytes_are_refused(session: Path) -> None:
    content = (session / "journal.jsonl").read_bytes()
    random = np.random.default_rng(2)
    for place in random.integers(0, len(content) - 1, 200).tolist():
        changed = bytearray(content)
        changed[place] ^= int(random.integers(1, 256))
        (session / "journal.jsonl").write_bytes(changed)
        with pytest.raises(InputError):
            open_session(session)


def test_lines_moved_lost_or_put_in_are_refused_with_what_is_known(session: Path) -> None:
    lines = lines_of(session)
    assert len(lines) >= 5
    for bad, known in (
        ([lines[1], lines[0], *lines[2:]], "line 1 does not fit its checksum.*no line fits"),
        ([*lines[:2], *lines[3:]], "line 3 .*lines 1 to 2 are as they were written"),
        ([*lines[:3], lines[2], *lines[3:]], "line 4 "),
        ([*lines[:2], re.sub(rb',"chain":"[0-9a-f]*"', b"", lines[2]), *lines[3:]], "line 3 "),
        ([], "which no attempt in the journal took"),
    ):
        write(session, bad)
        refused(session, known)


def test_settings_changed_half_way_are_refused(session: Path, finished: Path) -> None:
    path = session / "session.json"
    said = path.read_bytes()
    path.write_bytes(said.replace(b'"most_views": 5', b'"most_views": 50'))
    refused(session, "the settings were changed")
    # Also with a checksum made to fit: the journal begins with the old one.
    document = json.loads(said)
    document["settings"]["configuration"]["most_views"] = 50
    path.write_text(json.dumps(document))
    with pytest.raises(InputError) as error:
        read_settings(session)
    assert error.value.code == "edited"
    other = finished.parent / "other"
    if not other.exists():
        run(configured(3, most_views=4), other)
    shutil.copy(other / "session.json", path)
    refused(session, "line 1 does not fit")


def test_another_arm_than_at_the_beginning_is_refused(tmp_path: Path) -> None:
    from handeye.robots import shipped

    arm = tmp_path / "arm.urdf"
    text = (Path(shipped.__file__).parent / "arms" / "epson_c4l.urdf").read_text()
    arm.write_text(text)
    run(configured(2, robot=str(arm), most_views=3), tmp_path / "s")
    changed = re.sub(r'velocity="([0-9.]+)"', 'velocity="0.1"', text, count=1)
    assert changed != text
    arm.write_text(changed)
    with pytest.raises(InputError) as error:
        go_on(tmp_path / "s")
    assert error.value.code == "settings_changed"


def lose_corners(folder: Path) -> None:
    (folder / "corners" / "view_02.csv").unlink()


def lose_all_corners(folder: Path) -> None:
    shutil.rmtree(folder / "corners")


def lose_recording(folder: Path) -> None:
    (folder / "recording.toml").unlink()


@pytest.mark.parametrize("lose", [lose_corners, lose_all_corners, lose_recording])
def test_what_the_journal_has_is_made_again(session: Path, lose: Callable[[Path], None]) -> None:
    whole = Outcome.of(session)
    lose(session)
    assert Outcome.of(session) == whole
    assert len(read_recording(session).recording.views) == 5


def test_edits_of_the_recording_are_refused(session: Path) -> None:
    corners, table = session / "corners" / "view_02.csv", session / "recording.toml"
    good, said = corners.read_text(), table.read_text()
    number = good.split(",")[3]
    corners.write_text(good.replace(number, str(float(number) + 5), 1))
    refused(session, "view view_02 is not as in the journal")
    corners.write_text("id,u_px,v_px\nx,y,z\n")
    refused(session, "view_02")
    corners.write_text(good)
    table.write_text(said.replace('mounting = "eye_in_hand"', 'mounting = "eye_to_hand"'))
    refused(session, "are not those that the session began with")
    table.write_text(said[: len(said) // 2])
    refused(session, "recording.toml")
    table.write_text(said)
    open_session(session).close()


def test_partial_files_are_cleaned_up(session: Path) -> None:
    left = [
        session / ".recording.toml.0123456789ab.partial",
        session / "corners" / ".view_01.csv.0123456789ab.partial",
    ]
    kept = [session / "notes.partial", session / ".mine.partial"]
    for path in (*left, *kept):
        path.write_text("x")
    open_session(session).close()
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in kept)


def without_chain(folder: Path) -> None:
    """Turn a session into one of version 1."""
    document = json.loads((folder / "session.json").read_text())
    (folder / "session.json").write_text(
        json.dumps({"format": "handeye-session", "version": 1, "settings": document["settings"]})
    )
    write(folder, [re.sub(rb',"chain":"[0-9a-f]{32}"', b"", line) for line in lines_of(folder)])


def test_sessions_without_checksums_go_on(tmp_path: Path) -> None:
    configuration = configured(3, most_views=6)
    run(configuration, tmp_path / "undisturbed")
    session, store = begin(prepare(configuration), tmp_path / "old")
    for _ in range(3):
        step = session.next()
        session.take(step)  # type: ignore[arg-type]
    store.close()
    without_chain(tmp_path / "old")
    run(configuration, tmp_path / "old")
    assert Outcome.of(tmp_path / "old") == Outcome.of(tmp_path / "undisturbed")
    lines = lines_of(tmp_path / "old")
    assert [b'"chain"' in line for line in lines] == [False] * 3 + [True] * (len(lines) - 3)
    # From the first checksum on, every line has one, and what stands before is covered too.
    write(tmp_path / "old", [lines[0].replace(b"view_01.1", b"view_01.9"), *lines[1:]])
    refused(tmp_path / "old", "line 4 does not fit")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_for_a_journal_does_not_hang(session: Path) -> None:
    (session / "journal.jsonl").unlink()
    os.mkfifo(session / "journal.jsonl")
    with pytest.raises(InputError, match="not a regular file"):
        open_session(session)


def test_a_report_reads_the_journal(session: Path) -> None:
    entries = read_journal(session).entries
    assert sum(entry.view is not None for entry in entries) == 5
