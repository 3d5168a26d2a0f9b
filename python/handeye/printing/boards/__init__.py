"""Every family of targets that can be printed."""

from handeye.errors import InputError
from handeye.printing.boards import april_grid, charuco, chessboard, circle_grid
from handeye.printing.boards.base import Board, Ink, Measures
from handeye.types import Target

BOARDS: dict[str, Board] = {
    board.family: board for board in (chessboard.BOARD, circle_grid.BOARD, charuco.BOARD, april_grid.BOARD)
}


def board_of(family: str) -> Board:
    """Return how a family is printed.

    Raises
    ------
    InputError
        A family that nobody has drawn.
    """
    board = BOARDS.get(family)
    if board is None:
        raise InputError(
            f"target: family {family!r}, expected one of {', '.join(BOARDS)}", code="unknown_target"
        )
    return board


def ink_of(target: Target) -> Ink:
    """Return what is printed on a target.

    Raises
    ------
    InputError
        A family that nobody has drawn.
    """
    return board_of(target.family).ink(target)


__all__ = ["BOARDS", "Board", "Ink", "Measures", "board_of", "ink_of"]
