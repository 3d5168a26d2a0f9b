"""YAML from strangers: text, lists and tables, nothing else.

Numbers stay text until a document type asks for them, so nothing depends on how YAML 1.1 guesses (``1e-3``
is text to it, ``1:30`` a number in base 60). Aliases are refused: a few lines of them unfold to gigabytes. A
key that is there twice is refused: the reader could not know which of the two was meant.
"""

import itertools
import re
from collections.abc import Iterable
from pathlib import Path
from typing import cast

import yaml

from handeye.codes import Code
from handeye.datasets.reading import MIB, read_text
from handeye.errors import InputError

# The parser reads some 100 kB a second; a list of 10 000 images has 450 kB.
MAX_BYTES = MIB // 2
MAX_DOCUMENTS = 1000
# Numbers as NumPy and C++ print them, 1200. and 3.e-05, get their zero: not everybody reads them without.
_SHORT_NUMBER = re.compile(r"[+-]?\d{1,300}\.([eE][+-]?\d{1,5})?\Z", re.ASCII)


def read_yaml(path: Path) -> object:
    """Return the content of a YAML file as text, lists and tables.

    Raises
    ------
    InputError
        The file cannot be read, is too large, or is not such YAML.
    """
    documents = yaml_documents(read_text(path, MAX_BYTES), str(path))
    if len(documents) > 1:
        raise InputError(f"{path}: {len(documents)} documents, expected one", code=Code.NOT_YAML)
    return documents[0] if documents else None


def yaml_documents(text: str, where: str) -> list[object]:
    """Return the documents of a text in YAML.

    Raises
    ------
    InputError
        Not such YAML, or too long.
    """
    if len(text) > MAX_BYTES:
        raise InputError(
            f"{where}: {len(text)} characters, expected at most {MAX_BYTES}", code=Code.TOO_LARGE
        )
    try:
        roots = cast("Iterable[yaml.Node | None]", yaml.compose_all(text, Loader=yaml.BaseLoader))  # pyright: ignore[reportUnknownMemberType]
        return [_plain(root, set()) for root in itertools.islice(roots, MAX_DOCUMENTS)]
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise InputError(f"{where}: not YAML as expected: {error}", code=Code.NOT_YAML) from error


def _plain(node: yaml.Node | None, seen: set[int]) -> object:
    """Return what a node of the parsed text holds; an alias is a node that is met again."""
    if node is None:
        return None
    if id(node) in seen:
        raise ValueError("aliases (*name) are not accepted")
    seen.add(id(node))
    if isinstance(node, yaml.ScalarNode):
        return str(node.value).replace(".", ".0") if _SHORT_NUMBER.match(node.value) else str(node.value)
    if isinstance(node, yaml.SequenceNode):
        return [_plain(item, seen) for item in node.value]
    table: dict[str, object] = {}
    for key_node, value_node in node.value:
        key = _plain(key_node, seen)
        if not isinstance(key, str) or key in table:
            raise ValueError(f"a key that is there twice or is not text, line {key_node.start_mark.line + 1}")
        table[key] = _plain(value_node, seen)
    return table
