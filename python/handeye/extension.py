"""What other packages bring: members of a family by entry point, and libraries that only one member needs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from handeye.codes import Code
from handeye.errors import DeviceError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ROBOTS, CAMERAS, POLICIES = "handeye.robots", "handeye.cameras", "handeye.policies"


def announced(group: str) -> "dict[str, EntryPoint]":
    """Return the members that installed packages announce in a group, by name in alphabetical order."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - only where others are asked for

    return {point.name: point for point in sorted(entry_points(group=group), key=lambda point: point.name)}


def library(module: str, extra: str) -> Any:  # noqa: ANN401 - a module without types
    """Return the library of a device, imported now.

    Parameters
    ----------
    module
        Name of its module.
    extra
        The extra of this package that installs it.

    Raises
    ------
    DeviceError
        It is not installed or cannot be loaded; `code` is `library_missing`.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        absent = isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] == package
        found = "is not installed" if absent else f"cannot be loaded: {error}"
        raise DeviceError(
            f"the library {package} {found}",
            code=Code.LIBRARY_MISSING,
            hint=f"pip install 'handeye[{extra}]'",
        ) from error
