"""The loop that every session runs, with one camera or several: decide, do, write down, until the end."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, TypeVar

from handeye.session.attempt import Cell
from handeye.session.contract import check_at_rest
from handeye.session.deciding import FAILED, Attempts, EndReason, Halt, Step
from handeye.session.entry import Entry, Failure
from handeye.session.store import Store
from handeye.session.taking import Taker

S = TypeVar("S", bound=Attempts)
E = TypeVar("E")


class Stepping(ABC, Generic[S, E]):
    """Runs the loop on a cell and writes every attempt into a store.

    What is believed after some attempts (S) and what an end tells (E) are those of one camera or of several.

    Parameters
    ----------
    cell
        The world.
    store
        Open session.
    choose
        Decides where to go.
    """

    def __init__(self, cell: Cell, store: Store, choose: Callable[[S], Step | Halt]) -> None:
        self._cell = cell
        self._attempts = store
        self._decide = choose
        self._taker = Taker(cell, store)
        self._forgiven_up_to: int | None = None
        self._outvoted = 0

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the views or stations that count, in the order in which they were taken."""

    @abstractmethod
    def withdraw(self, name: str, why: str) -> Entry:
        """Take a view or station back: it stays in the journal, and counts no more."""

    @abstractmethod
    def end(self) -> E:
        """End here, because somebody says so, with the answer so far."""

    @abstractmethod
    def _situation(self) -> S | Halt:
        """Return what is believed now, or why nothing is to be done next."""

    @abstractmethod
    def _end(self, reason: EndReason, sentence: str) -> E:
        """Return the end, with the answer from what was taken so far."""

    def run(self) -> E:
        """Run until the end; an interruption stops the arm first and leaves the session whole.

        Raises
        ------
        DeviceError
            The robot does not keep the contract where it stands; nothing was sent to it.
        OutputError
            The disk does not take an attempt, also not when asked again.
        """
        check_at_rest(self._cell)
        try:
            while True:
                step = self.next()
                if not isinstance(step, Step):
                    return step
                self.take(step)
        except BaseException:
            self._cell.stop()
            raise

    def next(self) -> Step | E:
        """Decide what to do next, without doing it."""
        began = time.monotonic()
        if self._cell.robot_calls.pending:
            return self._end(
                EndReason.ROBOT_HANGS,
                "the last command to the robot has not come back, and nothing more is sent to it; "
                "the arm may still move",
            )
        situation = self._situation()
        answer = situation if isinstance(situation, Halt) else self._choose(situation)
        if isinstance(answer, Step):
            return replace(answer, seconds=time.monotonic() - began)
        return self._end(answer.reason, answer.sentence)

    def _entries(self) -> tuple[Entry, ...]:
        """Return the attempts, without withdrawals."""
        return tuple(entry for entry in self._attempts.entries if entry.withdraws is None)

    def _choose(self, situation: S) -> Step | Halt:
        """Choose; a session that had ended without an answer when it was opened gets as much again.

        That is as many attempts after failures, and views until they outvote those that give no answer.
        """
        if self._forgiven_up_to is None:
            self._forgiven_up_to = 0
            answer = self._decide(situation)
            if isinstance(answer, Halt) and answer.reason in FAILED and situation.missed:
                self._forgiven_up_to = situation.entries[-1].number
                answer = self._decide(self._forgiving(situation))
            if isinstance(answer, Step) or answer.reason in FAILED or not situation.is_open:
                return answer
            self._outvoted = situation.taken
        return self._decide(self._forgiving(situation))

    def _forgiving(self, situation: S) -> S:
        forgiven = sum(1 for entry in situation.missed if entry.number <= (self._forgiven_up_to or 0))
        return replace(situation, forgiven=forgiven, outvoted=self._outvoted)

    def take(self, step: Step) -> Entry:
        """Do a step, and write down what it brought.

        Raises
        ------
        OutputError
            The disk does not take it.
        """
        entry = self._taker.take(step)
        self._cell.observer.taken(entry, step.estimate)
        return entry

    def _withdraw(self, name: str, why: str) -> Entry:
        """Write down that a view or station counts no more; it stays in the journal.

        Raises
        ------
        OutputError
            The disk does not take it.
        """
        taken = next(
            e.brought for e in self._attempts.entries if e.brought is not None and e.brought.name == name
        )
        entry = Entry(
            len(self._attempts.entries) + 1,
            name,
            "withdraw",
            taken.T_base_flange,
            (),
            moved=False,
            failure=Failure.WITHDRAWN,
            detail=why,
            withdraws=name,
        )
        self._attempts.append(entry)
        self._cell.observer.taken(entry, None)
        return entry
