"""Write the reference pages from what the code says of itself: docstrings, the core's stub, `--help`.

The pages are made with every build, into `docs/reference`, and are not under version control.
"""

import ast
import importlib
import inspect
import io
import re
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

from handeye import errors
from handeye.cli.app import COMMANDS, make_app
from handeye.cli.failures import UnexpectedError, UsageError
from handeye.codes import Code
from handeye.errors import HandeyeError

ROOMS = ("handeye", "handeye.types", "handeye.errors", "handeye.datasets", "handeye.detection")
ROOMS += ("handeye.estimation", "handeye.planning", "handeye.robots", "handeye.cameras", "handeye.session")
ROOMS += ("handeye.export", "handeye.testing")
EXAMPLES = (
    "The examples, each of which is run by the tests, speak of a simulated cell: `recording` of nine views, "
    "its `camera`, `board` and `arm`, the `measurements` and the `estimate` from them, the `result` of "
    "solving it, the `folder` where it is written; and a `rig` of four cameras with its `rig_estimate`."
)
SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}$", re.MULTILINE)
LISTS = {"Parameters", "Attributes", "Returns", "Raises"}


def python_page() -> str:
    """Return the page of all public names, by room."""
    lines = ["# Python", "", "Units and frames are those of [the conventions](../conventions.md).", ""]
    lines += [EXAMPLES, ""]
    for name in ROOMS:
        room = importlib.import_module(name)
        names = [n for n in getattr(room, "__all__", []) if not n.startswith("__")]
        if not names:
            continue
        lines += [f"## {name}", "", *markdown(inspect.getdoc(room) or ""), ""]
        for public in names:
            lines += member(f"{name}.{public}", getattr(room, public))
    return "\n".join(lines) + "\n"


def member(name: str, value: object) -> list[str]:
    """Return what is said of a function or class, with its public methods."""
    if not (inspect.isclass(value) or inspect.isroutine(value)):
        return [f"### {name}", "", f"`{repr(value)[:200]}`", ""]
    lines = [f"### {name}", "", *signature(name.rpartition(".")[2], value), ""]
    lines += [*markdown(inspect.getdoc(value) or ""), ""]
    if inspect.isclass(value):
        for attribute, found in sorted(vars(value).items()):
            plain = found.__func__ if isinstance(found, classmethod | staticmethod) else found
            plain = plain.fget if isinstance(plain, property) else plain
            if attribute.startswith("_") or not inspect.isfunction(plain) or not plain.__doc__:
                continue
            lines += [f"**{attribute}**", ""]
            lines += [] if isinstance(found, property) else [*signature(attribute, plain), ""]
            lines += [*markdown(inspect.getdoc(plain) or ""), ""]
    return lines


def signature(name: str, value: object) -> list[str]:
    """Return the signature in a block, shortened where it is longer than a screen is wide."""
    try:
        text = f"{name}{inspect.signature(value)}"  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return []
    return ["```python", re.sub(r"<[^>]*? at 0x[0-9a-f]+>", "...", text), "```"]


def markdown(doc: str) -> list[str]:
    """Turn a docstring in the style of numpydoc into Markdown."""
    parts = SECTION.split(doc)
    lines = prose(parts[0])
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        lines += ["", f"*{title}*", "", *(entries(body) if title in LISTS else prose(body))]
    return lines


def entries(body: str) -> Iterator[str]:
    """Give a list of what is defined in a section: names, and indented below them what they are."""
    for line in body.strip("\n").splitlines():
        if line and not line.startswith(" "):
            yield f"- `{line.strip()}`"
        else:
            yield f"  {escaped(line.strip())}" if line.strip() else ""


def prose(text: str) -> list[str]:
    """Return paragraphs, with examples as code."""
    lines: list[str] = []
    code = False
    for line in text.strip("\n").splitlines():
        is_code = line.startswith((">>>", "...", "    ")) or (code and bool(line.strip()))
        if is_code != code:
            lines += ["```python" if is_code else "```", *([] if is_code else [""])]
            code = is_code
        lines.append(line if code or line.strip() == "::" else escaped(line))
    return [*lines, "```"] if code else lines


def escaped(text: str) -> str:
    """Return text in which nothing but code is markup."""
    pieces = re.split(r"(`+[^`]+`+)", text)
    return "".join(p if p.startswith("`") else re.sub(r"([\[\]<>*_$#|])", r"\\\1", p) for p in pieces)


def core_page(stub: Path) -> str:
    """Return the page of the compiled core, from its stub."""
    tree = ast.parse(stub.read_text())
    lines = ["# The core", "", "`handeye._core` is compiled from Rust. It knows no files and no clock.", ""]
    lines += [EXAMPLES, ""]
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        lines += [f"## {node.name}", ""]
        if isinstance(node, ast.FunctionDef):
            lines += ["```python", f"{node.name}({ast.unparse(node.args)})", "```", ""]
        lines += [*markdown(ast.get_docstring(node) or ""), ""]
        for inner in node.body if isinstance(node, ast.ClassDef) else []:
            if isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
                lines += [f"**{inner.name}**", "", *markdown(ast.get_docstring(inner) or ""), ""]
    return "\n".join(lines) + "\n"


def command_page() -> str:
    """Return the page of all commands, as `--help` has them."""
    lines = [
        "# Command line",
        "",
        "What `handeye COMMAND --help` prints. How to: [commands](../commands/index.md).",
        "",
    ]
    for name, _, line in COMMANDS:
        console = Console(width=100, record=True, file=io.StringIO(), force_terminal=False)
        make_app(name).help_print([name], console=console)
        text = "\n".join(part.rstrip() for part in console.export_text().strip().splitlines())
        lines += [f"## handeye {name}", "", line, "", "```text", text, "```", ""]
    return "\n".join(lines) + "\n"


def codes_page() -> str:
    """Return the page of all codes of errors."""
    rows = (f"| `{code}` | {code.meaning} | {code.advice} |" for code in sorted(Code))
    lines = [
        "# Codes of errors",
        "",
        "What `error.code` can be, in Python and in the output of `--json`; data faults have",
        "[pages of their own](../faults/index.md), and drivers of other packages may add words.",
        "The command line shows the last column where an error has no hint of its own.",
        "",
        "| code | what it means | what to do |",
        "|---|---|---|",
        *(row.replace("<", "&lt;") for row in rows),
        "",
        "## Exit codes",
        "",
        "The class of the error decides the exit code of the command line.",
        "",
        "| class | exit code | its code where none is given |",
        "|---|---|---|",
    ]
    kinds = [kind for kind in vars(errors).values() if inspect.isclass(kind)]
    lines += [
        f"| `{kind.__name__}` | {int(kind.exit_code)} | `{kind.default_code}` |"
        for kind in [*(k for k in kinds if issubclass(k, HandeyeError)), UsageError, UnexpectedError]
    ]
    return "\n".join(lines) + "\n"


def write(app: Sphinx) -> None:
    """Write the pages, and touch none that is as it should be."""
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    stub = Path(app.srcdir).parent / "python" / "handeye" / "_core.pyi"
    pages = {"python.md": python_page(), "core.md": core_page(stub), "command-line.md": command_page()}
    pages["codes.md"] = codes_page()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def setup(app: Sphinx) -> ExtensionMetadata:
    """Write before the pages are read."""
    app.connect("builder-inited", write)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
