"""Digests of pieces of work and of the program, so that a result is only ever taken for what it is of."""

import dataclasses
import functools
import hashlib
import platform
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np

import handeye
from handeye import _core
from handeye.types import Pose

_SIZE = 16


@functools.cache
def program_digest() -> str:
    """Digest of all that results depend on besides their piece: sources, core, libraries, processor."""
    parts = [platform.machine(), platform.python_version(), np.__version__, cv2.__version__]
    digest = hashlib.blake2b(" ".join(parts).encode(), digest_size=_SIZE)
    sources = sorted(Path(handeye.__file__).parent.rglob("*.py"))
    for file in [*sources, Path(_core.__file__)]:
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


class Digester:
    """Makes digests; what it has met once it remembers, as pieces share their recordings."""

    def __init__(self) -> None:
        # The value is kept with its digest: another might get its address otherwise.
        self._known: dict[int, tuple[object, bytes]] = {}

    def of(self, value: object) -> bytes:
        """Digest of a value made of numbers, texts, arrays, dataclasses, functions and what holds them.

        Raises
        ------
        TypeError
            It holds something else.
        """
        return self._fields(value) if _is_dataclass(value) else self._plain(value)

    def _field(self, value: object) -> bytes:
        if not _is_dataclass(value):
            return self._plain(value)
        known = self._known.get(id(value))
        if known is None:
            known = (value, self._fields(value))
            self._known[id(value)] = known
        return known[1]

    def _plain(self, value: object) -> bytes:
        if isinstance(value, Enum):
            return self._hash(_name(type(value)), value.name)
        if value is None or isinstance(value, bool | int | float | str | bytes | Path):
            return self._hash(type(value).__name__, repr(value))
        if isinstance(value, Pose):
            return self._hash("pose", self.of(value.matrix))
        if isinstance(value, np.ndarray):
            array = cast("np.ndarray[Any, Any]", value)
            return self._hash("array", str(array.dtype), str(array.shape), array.tobytes())
        if isinstance(value, Mapping):
            pairs = cast("Mapping[object, object]", value)
            return self._hash("mapping", *(self._field(item) for pair in pairs.items() for item in pair))
        if isinstance(value, Sequence):
            items = cast("Sequence[object]", value)
            return self._hash("sequence", *(self._field(item) for item in items))
        if isinstance(value, functools.partial):
            bound = cast("functools.partial[object]", value)
            return self._hash("partial", self.of(bound.func), self.of(bound.args), self.of(bound.keywords))
        if callable(value) and hasattr(value, "__qualname__"):
            return self._hash("function", _name(value))
        raise TypeError(f"no digest of a {type(value).__name__}")

    def _fields(self, value: object) -> bytes:
        fields = dataclasses.fields(cast("Any", value))
        return self._hash(_name(type(value)), *(self._field(getattr(value, field.name)) for field in fields))

    @staticmethod
    def _hash(*parts: str | bytes) -> bytes:
        digest = hashlib.blake2b(digest_size=_SIZE)
        for part in parts:
            content = part.encode() if isinstance(part, str) else part
            # With its length: no two lists of parts read the same.
            digest.update(len(content).to_bytes(8, "little"))
            digest.update(content)
        return digest.digest()


def _is_dataclass(value: object) -> bool:
    return hasattr(type(value), "__dataclass_fields__")


def _name(thing: object) -> str:
    return f"{getattr(thing, '__module__', '')}.{getattr(thing, '__qualname__', '')}"
