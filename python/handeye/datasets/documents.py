"""Files with a structure, as text, lists and tables: JSON, YAML, XML of OpenCV, whatever wrote them.

Nothing is executed and no tag of YAML means anything here. Numbers of YAML and XML stay text until somebody
asks for one, see `handeye.datasets.yaml_reading`.

`cv::FileStorage` writes ``%YAML:1.0`` where YAML wants ``%YAML 1.0``, and matrices as ``!!opencv-matrix``
with rows, cols, dt, data (OpenCV, `persistence_yml.cpp`, `persistence_xml.cpp`).
"""

import json
import re
from pathlib import Path
from typing import cast

from handeye.codes import Code
from handeye.datasets.reading import MIB, read_text
from handeye.datasets.yaml_reading import MAX_BYTES as MAX_YAML_BYTES
from handeye.datasets.yaml_reading import yaml_documents
from handeye.errors import InputError

MAX_JSON_BYTES = 16 * MIB
MAX_XML_BYTES = MIB // 2
SUFFIXES = frozenset({".json", ".yaml", ".yml", ".xml"})
_FILE_STORAGE_HEAD = re.compile(r"\A\s*%YAML:?\s*\d\.\d\s*\n")
_SKIPPED = {"<!--": "-->", "<?": "?>"}
_MAX_DEPTH = 30


def read_document_file(path: Path) -> object:
    """Return the content of a JSON, YAML or FileStorage XML file as text, numbers, lists and tables.

    Of a YAML file with several documents, as `rostopic echo` prints them, the first.

    Raises
    ------
    InputError
        The file cannot be read, is too large, or is not what its name says.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        return _json(path)
    if suffix == ".xml":
        return _xml(path)
    return yaml_of(read_text(path, MAX_YAML_BYTES), str(path))


def yaml_of(text: str, where: str) -> object:
    """Return what a text in YAML, also that of `cv::FileStorage`, holds.

    Raises
    ------
    InputError
        Not YAML as expected.
    """
    documents = yaml_documents(_FILE_STORAGE_HEAD.sub("", text, count=1), where)
    return next((document for document in documents if document not in (None, "")), None)


def _json(path: Path) -> object:
    text = read_text(path, MAX_JSON_BYTES)
    try:
        return cast("object", json.loads(text))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {str(error)[:200]}", code=Code.NOT_JSON) from error


def _xml(path: Path) -> object:
    """Return the elements of FileStorage XML as tables; text stays text.

    Only elements and text: a document type or an entity is refused, so nothing can unfold.
    """
    text = read_text(path, MAX_XML_BYTES)
    if "<!DOCTYPE" in text or "<!ENTITY" in text or "<![CDATA[" in text:
        raise InputError(f"{path}: XML with a document type, expected plain elements", code=Code.NOT_XML)
    # Each open element: its name, its children, its text.
    stack: list[tuple[str, list[tuple[str, object]], list[str]]] = [("", [], [])]
    end = 0
    while (start := text.find("<", end)) >= 0:
        stack[-1][2].append(text[end:start])
        mark = next((m for m in _SKIPPED if text.startswith(m, start)), None)
        stop = text.find(">" if mark is None else _SKIPPED[mark], start)
        if stop < 0:
            raise InputError(f"{path}: XML that is cut off", code=Code.NOT_XML)
        end = stop + (1 if mark is None else len(_SKIPPED[mark]))
        if mark is not None:
            continue
        tag = text[start + 1 : stop].strip()
        closing, empty = tag.startswith("/"), tag.endswith("/")
        name = (tag.strip("/").split(maxsplit=1) or [""])[0]
        if not closing:
            stack.append((name, [], []))
            if len(stack) > _MAX_DEPTH:
                raise InputError(f"{path}: more than {_MAX_DEPTH} elements in each other", code=Code.NOT_XML)
        if closing or empty:
            opened, children, words = stack.pop()
            if opened != name or not stack:
                raise InputError(f"{path}: </{name[:40]}> closes nothing", code=Code.NOT_XML)
            stack[-1][1].append((name, _element(children, " ".join(words).strip())))
    if len(stack) != 1 or not stack[0][1]:
        raise InputError(f"{path}: XML that is cut off, or none", code=Code.NOT_XML)
    return stack[0][1][0][1]


def _element(children: list[tuple[str, object]], text: str) -> object:
    if not children:
        return text
    names = [name for name, _ in children]
    if len(set(names)) == len(names):
        return dict(children)
    return [value for _, value in children] if set(names) == {"_"} else _grouped(children)


def _grouped(children: list[tuple[str, object]]) -> dict[str, object]:
    table: dict[str, object] = {}
    for name, value in children:
        if name in table:
            held = table[name]
            table[name] = [*held, value] if isinstance(held, _Several) else _Several([held, value])
        else:
            table[name] = value
    return table


class _Several(list[object]):
    """Elements of one name."""
