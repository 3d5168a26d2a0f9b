"""Documents with versions, commands, and the one page that drives."""

import json
import threading
import time

import pytest

from handeye.errors import InputError
from handeye.ui.hub import MOST_WATCHERS, SHARE, Command, Hub

ANNE, BERT = "a" * 16, "b" * 16


def test_a_document_is_made_when_it_is_asked_for_and_once() -> None:
    hub, made = Hub(), list[int]()
    hub.publish("scene", lambda: made.append(1) or {"x": len(made)})
    assert made == []
    assert json.loads(hub.document("scene")) == {"version": 1, "data": {"x": 1}}
    assert hub.document("scene") == hub.document("scene")
    assert made == [1]
    hub.publish("scene", lambda: {"x": 7})
    assert json.loads(hub.document("scene")) == {"version": 2, "data": {"x": 7}}
    with pytest.raises(InputError, match="no document"):
        hub.document("secrets")


def test_waiting_ends_with_a_change() -> None:
    hub = Hub()
    seen = hub.versions()
    threading.Timer(0.05, lambda: hub.publish("scene", dict)).start()
    assert hub.wait(seen, 10.0) == seen | {"scene": 1}


def spend(seconds: float) -> None:
    """Compute for so long."""
    until = time.process_time() + seconds
    while time.process_time() < until:
        pass


def test_a_session_that_computes_is_left_alone_until_the_last_telling_was_paid_for() -> None:
    hub = Hub()
    hub.publish("scene", dict)
    seen = hub.wait({}, 0)
    hub.rests(resting=False)
    hub.charge("scene", 0.4 * SHARE)
    hub.publish("scene", dict)
    assert hub.wait(seen, 0) == seen
    hub.say("Words cost nothing.")
    hub.charge("talk", 1000.0)
    hub.say("Nor do these.")
    seen |= {"talk": 3}
    assert hub.wait(seen, 0) == seen
    spend(0.45)
    assert hub.wait(seen, 0) == seen | {"scene": 2}


def test_what_is_told_while_the_session_rests_leaves_no_debt() -> None:
    hub = Hub()
    hub.publish("status", dict)
    seen = hub.wait({}, 0)
    hub.charge("status", 1000.0)
    hub.rests(resting=False)
    hub.publish("status", dict)
    assert hub.wait(seen, 0) == seen | {"status": 2}


def test_a_program_that_has_nothing_to_do_tells_at_once() -> None:
    hub = Hub()
    hub.publish("scene", dict)
    seen = hub.wait({}, 0)
    hub.rests(resting=False)
    hub.charge("scene", 1000.0)
    hub.publish("scene", dict)
    assert hub.wait(seen, 0) == seen
    assert hub.wait(seen, 10.0) == seen | {"scene": 2}


def test_a_session_rests_while_it_waits_for_a_person() -> None:
    hub = Hub()
    hub.rests(resting=False)
    assert hub.next_command(0) is None
    assert not hub.rests(resting=False)
    waiting = threading.Thread(target=hub.next_command, args=(None,))
    waiting.start()
    hub.publish("scene", dict)
    seen = hub.wait(hub.versions() | {"scene": 0}, 10.0)
    assert seen["scene"] == 1
    hub.enter(ANNE)
    hub.command(ANNE, Command("go"))
    waiting.join(10)
    assert not hub.rests(resting=False)


def test_the_first_page_drives_until_another_takes_over() -> None:
    hub = Hub()
    hub.enter(ANNE)
    hub.enter(BERT)
    hub.command(ANNE, Command("go"))
    with pytest.raises(InputError, match="another one drives"):
        hub.command(BERT, Command("go"))
    hub.take_over(BERT)
    with pytest.raises(InputError, match="another one drives"):
        hub.command(ANNE, Command("skip"))
    hub.command(BERT, Command("skip"))
    assert [hub.next_command(0), hub.next_command(0), hub.next_command(0)] == [
        Command("go"),
        Command("skip"),
        None,
    ]
    with pytest.raises(InputError, match="does not look on"):
        hub.take_over("c" * 16)


def test_a_page_that_is_loaded_again_still_drives() -> None:
    hub = Hub()
    hub.enter(ANNE)
    hub.leave(ANNE)
    hub.enter(BERT)
    hub.enter(ANNE)
    hub.command(ANNE, Command("go"))


def test_everybody_may_stop_and_the_session_waits_afterwards() -> None:
    hub, stopped = Hub(), list[str]()
    hub.on_stop(lambda: stopped.append("stopped"))
    hub.enter(ANNE)
    hub.enter(BERT)
    hub.command(BERT, Command("stop"))
    assert stopped == ["stopped"]
    assert hub.next_command(0) == Command("pause")
    hub.on_stop(lambda: "no answer within 5 s")
    hub.command(ANNE, Command("stop"))
    assert "NOT confirmed: no answer within 5 s" in json.loads(hub.document("talk"))["data"]["messages"][-1]


def test_a_question_is_answered_once_by_who_drives_or_ended_by_a_stop() -> None:
    hub, answers = Hub(), list[str]()
    hub.enter(ANNE)

    def ask() -> None:
        try:
            answers.append(hub.ask("pose?"))
        except EOFError:
            answers.append("stopped")

    for press in ("answer", "stop"):
        asking = threading.Thread(target=ask)
        asking.start()
        question = None
        while question is None:
            question = json.loads(hub.document("talk"))["data"]["question"]
        with pytest.raises(InputError, match="not open any more"):
            hub.command(ANNE, Command("answer", {"id": "other", "text": "1 2 3"}))
        hub.command(ANNE, Command(press, {"id": question["id"], "text": "1 2 3"}))
        asking.join(10)
    assert answers == ["1 2 3", "stopped"]


def test_too_many_watchers_are_refused() -> None:
    hub = Hub()
    for _ in range(MOST_WATCHERS):
        hub.enter(ANNE)
    with pytest.raises(InputError, match="look on already"):
        hub.enter(BERT)


@pytest.mark.parametrize("action", ["move_to", "", "__init__"])
def test_unknown_actions_are_refused(action: str) -> None:
    hub = Hub()
    hub.enter(ANNE)
    with pytest.raises(InputError, match="no action"):
        hub.command(ANNE, Command(action))
