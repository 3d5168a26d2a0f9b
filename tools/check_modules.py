"""Refuse circles between the modules of a crate, and arrows of the core that point up.

Rust allows modules of a crate to use each other in circles, and no lint finds them. This reads the `use`
lines and the paths in the code, follows re-exports to the file that a name comes from, and prints every
circle and every arrow that `LAYERS` does not allow. Tests are left out: they may use what they like.

python3 tools/check_modules.py
"""

import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# The rooms of the core from top to bottom. A room may use only rooms in the lines below its own.
LAYERS = [
    {"planning"},
    {"information"},
    {"estimation"},
    {"least_squares", "planar_pose"},
    {"pose", "closed_form"},
    {"camera", "kinematics"},
    {"se3"},
    {"imaging", "batched_algebra", "positive"},
    {"simd"},
    {"error", "interrupt", "threads"},
]
# Rooms that tests may use and nothing else.
FOR_TESTS = {"testing"}
# Circles inside these rooms are not looked for.
EXEMPT: dict[str, str] = {}

Module = tuple[str, ...]
Reach = tuple[Module, str | None]

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
STRING = re.compile(r'b?r#*"(?:.*?)"#*|"(?:\\.|[^"\\])*"', re.DOTALL)
USE = re.compile(r"(?:^|(?<=[;{}\s]))(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);", re.DOTALL)
CHILD = re.compile(r"\bmod\s+(\w+)\s*;")
PATH = re.compile(r"(?<![\w:])((?:\w+::)+\w+)")


@dataclass
class Source:
    """A file: its modules declared, its imports as (path, name, public), and the paths in its code."""

    path: Path
    children: set[str] = field(default_factory=set)
    imports: list[tuple[list[str], str, bool]] = field(default_factory=list)
    paths: list[list[str]] = field(default_factory=list)


def without_tests(text: str) -> str:
    """The code of a file, comments, strings and what is compiled for tests only left out."""
    text = STRING.sub('""', COMMENT.sub("", text))
    while (found := re.search(r"#\[cfg\(test\)\]\s*", text)) is not None:
        text = text[: found.start()] + text[end_of_item(text, found.end()) :]
    return text


def end_of_item(text: str, start: int) -> int:
    """Where the item that begins at `start` ends: at its semicolon or at its closing brace."""
    depth = 0
    for at in range(start, len(text)):
        if text[at] == "{":
            depth += 1
        elif text[at] == "}":
            depth -= 1
        if depth == 0 and text[at] in ";}":
            return at + 1
    return len(text)


def leaves(tree: str, before: tuple[str, ...] = ()) -> Iterator[tuple[list[str], str]]:
    """Path and local name of everything that a `use` tree brings in."""
    tree = tree.strip()
    if "{" in tree:
        head, body = tree.split("{", 1)
        prefix = before + tuple(part for part in head.strip().split("::") if part)
        depth, begin = 0, 0
        body = body[: body.rindex("}")] + ","
        for at, letter in enumerate(body):
            depth += (letter == "{") - (letter == "}")
            if letter == "," and depth == 0:
                if body[begin:at].strip():
                    yield from leaves(body[begin:at], prefix)
                begin = at + 1
        return
    path, _, name = tree.partition(" as ")
    parts = [*before, *(part.strip() for part in path.split("::"))]
    if parts[-1] == "self" and len(parts) > 1:
        parts.pop()
    yield parts, name.strip() or parts[-1]


def read(path: Path) -> Source:
    """Read a file."""
    text = without_tests(path.read_text(encoding="utf-8"))
    source = Source(path, children=set(CHILD.findall(text)))
    for public, tree in USE.findall(text):
        source.imports += [(parts, name, bool(public)) for parts, name in leaves(tree)]
    source.paths = [found.split("::") for found in PATH.findall(USE.sub("", text))]
    return source


def sources(root: Path) -> dict[Module, Source]:
    """Every module of a crate by its path from the root of the crate, tests left out."""
    found: dict[Module, Source] = {}

    def visit(module: Module, path: Path, folder: Path) -> None:
        found[module] = source = read(path)
        for child in source.children:
            options = [folder / f"{child}.rs", folder / child / "mod.rs"]
            file = next((option for option in options if option.exists()), None)
            if file is not None:
                visit((*module, child), file, folder / child)

    visit((), root / "lib.rs", root)
    return found


class Crate:
    """The modules of a crate and what they use of each other."""

    def __init__(self, root: Path) -> None:
        self.modules = sources(root)

    def reach(self, module: Module, parts: list[str], depth: int = 0) -> Module | None:
        """The module whose file holds what a path in `module` names; None for another crate's."""
        at, rest = module, list(parts)
        if rest[0] == "crate":
            at, rest = (), rest[1:]
        elif rest[0] in {"self", "super"}:
            while rest and rest[0] in {"self", "super"}:
                at = at[:-1] if rest[0] == "super" else at
                rest = rest[1:]
        elif rest[0] not in self.modules[module].children and not self._imported(module, rest[0]):
            return None
        while rest:
            if rest[0] in self.modules[at].children and (*at, rest[0]) in self.modules:
                at, rest = (*at, rest[0]), rest[1:]
                continue
            path = self._imported(at, rest[0])
            if path is None or depth > 20:
                return at
            return self.reach(at, [*path, *rest[1:]], depth + 1)
        return at

    def _imported(self, module: Module, name: str) -> list[str] | None:
        paths = (path for path, local, _ in self.modules[module].imports if local == name)
        return next((path for path in paths if path != [name]), None)

    def uses(self) -> dict[Module, set[Module]]:
        """Which modules each module uses. A parent that hands on a name of its child does not use it."""
        arrows: dict[Module, set[Module]] = {}
        for module, source in self.modules.items():
            used = {self.reach(module, path) for path in source.paths}
            for path, _, public in source.imports:
                there = self.reach(module, path)
                if not (public and there is not None and there[: len(module)] == module):
                    used.add(there)
            arrows[module] = {there for there in used if there is not None} - {module}
        return arrows


def circles(arrows: dict[Module, set[Module]]) -> list[list[Module]]:
    """Sets of modules that reach each other (Tarjan, "Depth-first search and linear graph algorithms")."""
    index: dict[Module, int] = {}
    low: dict[Module, int] = {}
    stack: list[Module] = []
    found: list[list[Module]] = []

    def visit(node: Module) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(arrows.get(node, ())):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            part = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(part) > 1:
                found.append(sorted(part))

    for node in sorted(arrows):
        if node not in index:
            visit(node)
    return found


def between_siblings(arrows: dict[Module, set[Module]], parent: Module) -> dict[Module, set[Module]]:
    """The arrows inside `parent`, each of its modules taken together with everything below it."""
    depth = len(parent)
    inside: dict[Module, set[Module]] = {}
    for module, used in arrows.items():
        if len(module) > depth and module[:depth] == parent:
            own = module[: depth + 1]
            near = [other for other in used if len(other) > depth and other[:depth] == parent]
            inside.setdefault(own, set()).update({other[: depth + 1] for other in near} - {own})
    return inside


def all_circles(arrows: dict[Module, set[Module]]) -> list[list[Module]]:
    """Circles between files, and between folders taken as a whole."""
    found = circles(arrows)
    for parent in sorted({module[:-1] for module in arrows if module}):
        found += [circle for circle in circles(between_siblings(arrows, parent)) if circle not in found]
    return found


def forbidden_arrows(arrows: dict[Module, set[Module]], layers: Iterable[set[str]]) -> list[str]:
    """Arrows between rooms that do not point down, and rooms that no layer names."""
    height = {room: at for at, layer in enumerate(layers) for room in layer}
    found: list[str] = []
    for module, used in sorted(arrows.items()):
        for other in sorted(used):
            if not module or not other or module[0] == other[0]:
                continue
            if other[0] in FOR_TESTS:
                found.append(f"{name_of(module)} uses {name_of(other)}, which is for tests")
            elif {module[0], other[0]} <= height.keys() and height[module[0]] >= height[other[0]]:
                found.append(f"{name_of(module)} uses {name_of(other)}, which is not below it")
    rooms = {module[0] for module in arrows if module} - FOR_TESTS
    return found + [f"{room} is in no layer" for room in sorted(rooms - height.keys())]


def name_of(module: Module) -> str:
    """A module as code names it."""
    return "::".join(("crate", *module))


def main() -> int:
    """Return 1 if there is a circle or a forbidden arrow."""
    complaints: list[str] = []
    for crate in ("handeye-core", "handeye-py"):
        arrows = Crate(ROOT / "crates" / crate / "src").uses()
        complaints += [
            f"{crate}: circle: {', '.join(map(name_of, circle))}"
            for circle in all_circles(arrows)
            if not {module[0] for module in circle if module} & EXEMPT.keys()
        ]
        if crate == "handeye-core":
            complaints += [f"{crate}: {found}" for found in forbidden_arrows(arrows, LAYERS)]
    for complaint in complaints:
        print(complaint, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    raise SystemExit(main())
