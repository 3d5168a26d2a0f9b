"""From plain JSON or TOML values to checked ones."""

from typing import Any, TypeVar

import msgspec

from handeye.codes import Code
from handeye.errors import InputError

T = TypeVar("T")


class Document(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True, kw_only=True):
    """Base of the plain documents: a field that nobody expects is an error, not a comment."""


def read_document(data: object, kind: type[T], what: str, *, lax: bool = False) -> T:
    """Check plain values (dicts, lists, numbers, strings) against a document type.

    Parameters
    ----------
    data
        The plain value.
    kind
        A `Document`, a dataclass or any type that msgspec knows.
    what
        What is being read, such as ``recording.toml`` or ``camera``; starts the error message.
    lax
        Accept numbers written as text, as in formats that carry no types.

    Raises
    ------
    InputError
        The value does not fit; the message ends with the path of the field, such as ``$.camera.lens``.
    """
    try:
        return msgspec.convert(data, kind, strict=not lax)
    except msgspec.ValidationError as error:
        raise InputError(f"{what}: {_readable(str(error))}", code=Code.INVALID_FIELD) from error
    except (OverflowError, RecursionError, ValueError) as error:
        raise InputError(f"{what}: unusable value ({error})", code=Code.INVALID_FIELD) from error


def _readable(message: str) -> str:
    """Return msgspec's message with the field before the complaint."""
    complaint, _, path = message.partition(" - at `$")
    field = path.removesuffix("`").removeprefix(".")
    return f"field {field}: {complaint}" if field else complaint


def without_none(**fields: Any) -> dict[str, Any]:  # noqa: ANN401 - values of any plain type
    """Return a dict of the fields that have a value; TOML knows no null."""
    return {name: value for name, value in fields.items() if value is not None}
