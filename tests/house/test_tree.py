"""What no file of this repository may contain."""

import ast
import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "handeye"

# Folders that exist on one person's machine only.
PRIVATE_PATH = re.compile(r"(?<![\w.~/-])/(?:work|root|tmp|home|Users)/\w")
CANONICAL_REGISTRY = "registry+https://github.com/rust-lang/crates.io-index"
VAGUE_NAMES = {"common", "helper", "helpers", "misc", "util", "utils"}

FORBIDDEN_IMPORTS = {"cloudpickle", "dill", "marshal", "pickle", "shelve"}
FORBIDDEN_CALLS = {
    "eval", "exec", "joblib.load", "numpy.fromfile", "os.popen", "os.system", "yaml.load", "yaml.unsafe_load",
}  # fmt: skip


def files() -> list[Path]:
    """Every file that is, or is about to be, under version control."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    try:
        listing = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git working tree")
    return [path for name in listing.split("\0") if name and (path := ROOT / name).is_file()]


def text(path: Path) -> str:
    """The text of a file; nothing for a picture."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def dotted(node: ast.expr) -> str:
    """`a.b.c` for a chain of attributes; nothing for other expressions."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def unsafe_uses(source: str) -> list[str]:
    """Ways in which Python source runs what a file says."""
    found: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [a.name for a in node.names if a.name.split(".")[0] in FORBIDDEN_IMPORTS]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module] if node.module.split(".")[0] in FORBIDDEN_IMPORTS else []
        elif isinstance(node, ast.Call):
            name = dotted(node.func).replace("np.", "numpy.", 1)
            found += [name] if name in FORBIDDEN_CALLS else []
            for keyword in node.keywords:
                is_true = isinstance(keyword.value, ast.Constant) and keyword.value.value is True
                if is_true and keyword.arg in {"allow_pickle", "shell"}:
                    found.append(f"{name}({keyword.arg}=True)")
    return found


def test_no_private_paths() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
        for path in files()
        for number, line in enumerate(text(path).splitlines(), start=1)
        if PRIVATE_PATH.search(line)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "line", ["see /" + "work/main", '"/' + "tmp/a.csv", "x=/" + "root/b", "(/" + "home/me)"]
)
def test_private_paths_are_recognised(line: str) -> None:
    assert PRIVATE_PATH.search(line)


def test_locked_requirements_name_no_address() -> None:
    names = ["Cargo.lock", *(str(p.relative_to(ROOT)) for p in (ROOT / "requirements").glob("*.txt"))]
    found = [
        f"{name}: {line}"
        for name in names
        for line in (ROOT / name).read_text().replace(CANONICAL_REGISTRY, "").splitlines()
        if "://" in line or "--index-url" in line or "--find-links" in line
    ]
    assert not found, "\n".join(found)


def test_every_locked_requirement_has_an_exact_version_and_a_hash() -> None:
    for name in ("run.txt", "dev.txt"):
        body = (ROOT / "requirements" / name).read_text().replace("\\\n", " ")
        for line in body.splitlines():
            assert line.startswith("#") or ("==" in line and "--hash=sha256:" in line), f"{name}: {line[:80]}"


def pins(name: str) -> dict[str, str]:
    """Package and version of every line of a file in `requirements`."""
    lines = (ROOT / "requirements" / name).read_text().splitlines()
    return dict(line.split()[0].split("==") for line in lines if "==" in line)


def test_both_requirement_files_agree() -> None:
    assert pins("run.txt").items() <= pins("dev.txt").items()


@pytest.mark.parametrize(("name", "groups"), [("run.txt", {"build"}), ("dev.txt", {"build", "dev", "docs"})])
def test_locked_requirements_are_those_of_the_project(name: str, groups: set[str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = list(project["project"]["dependencies"])
    for group in groups:
        wanted += [entry for entry in project["dependency-groups"][group] if isinstance(entry, str)]
    locked = pins(name)
    stale = [
        entry
        for requirement in map(Requirement, wanted)
        if not requirement.specifier.contains(locked.get(entry := requirement.name, "0"))
    ]
    assert not stale, f"{name} does not meet pyproject.toml for {stale}: run `make lock`"


def test_package_runs_nothing_that_a_file_says() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {use}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for use in unsafe_uses(path.read_text())
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from pickle import loads",
        "import numpy as np\nnp.load('a', allow_pickle=True)",
        "import os\nos.system('ls')",
        "import yaml\nyaml.load('a')",
        "eval('1')",
        "import subprocess\nsubprocess.run('ls', shell=True)",
    ],
)
def test_unsafe_uses_are_recognised(source: str) -> None:
    assert unsafe_uses(source)


def test_no_room_for_odds_and_ends() -> None:
    vague = [
        str(path.relative_to(ROOT))
        for path in files()
        if VAGUE_NAMES & {Path(part).stem for part in path.relative_to(ROOT).parts}
    ]
    assert not vague, vague
