"""Peers that may be missing."""

from importlib import import_module
from typing import Any


class MissingPeerError(Exception):
    """A peer cannot take part; the message says why."""


def optional(package: str, module: str | None = None) -> Any:  # noqa: ANN401 - of a package that may be missing
    """Import a package that need not be there.

    Raises
    ------
    MissingPeerError
        It is not installed, or does not load.
    """
    try:
        return import_module(module or package)
    except ModuleNotFoundError:
        raise MissingPeerError(f"{package} is not installed (requirements/bench.txt)") from None
    except ImportError as error:
        raise MissingPeerError(f"{package} does not load: {error}") from None
