"""Words that a reader stumbles over are refused: in the documents, the messages, the docstrings and the comments."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# What to avoid, and what to write in its place.
WORDS = {
    r"whoever": "name the person or the program",
    r"anew": "again",
    r"(?:leave|leaves|leaving|left) (?:it |them )?away": "leave out, not given",
    r"give or take": "within, or the standard deviation",
    r"dear(?:er|est|ly)?": "costly",
    r"says? it all": "say what it says",
    r"a matter of names": "gauge freedom",
}
# Names that the field has a better one for.
NAMES = {
    r"side_by_side|SideBySide": "batched",
    r"[Ss]ieve": "constraints",
    r"plan_jointly|JointPlan": "plan_batch, BatchPlan",
    r"Desk": "Workspace",
}

# Scripts of the test room itself are left out: they quote the words.
FOLDERS = {
    "docs": ("*.md",),
    "python/handeye": ("*.py", "*.pyi", "*.html"),
    "crates": ("*.rs",),
    "tools": ("*.py",),
    "examples": ("*.py",),
}
FILES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "Makefile")
# Between the words of a phrase: also the end of a line, and the mark of a comment.
SPACE = r"[\s#/*]+"
# Uses of a name that are not meant.
ELSEWHERE = {"crates/handeye-core/src/simd/tests.rs"}


def files() -> list[Path]:
    found = [ROOT / name for name in FILES]
    for folder, patterns in FOLDERS.items():
        found += [path for pattern in patterns for path in sorted((ROOT / folder).rglob(pattern))]
    return [path for path in found if "_build" not in path.parts]


def uses(text: str, words: dict[str, str]) -> list[tuple[int, str, str]]:
    """Line, found word and advice; a phrase may run over the end of a line."""
    found: list[tuple[int, str, str]] = []
    for word, advice in words.items():
        flags = re.IGNORECASE if words is WORDS else re.NOFLAG
        spaced = word.replace(" ", SPACE)
        pattern = re.compile(rf"\b(?:{spaced})\b", flags)
        found += [(text.count("\n", 0, at.start()) + 1, at[0], advice) for at in pattern.finditer(text)]
    return found


def test_no_word_that_a_reader_stumbles_over() -> None:
    found: list[str] = []
    for path in files():
        name = path.relative_to(ROOT).as_posix()
        text = path.read_text(encoding="utf-8")
        here = uses(text, WORDS) + ([] if name in ELSEWHERE else uses(text, NAMES))
        found += [f'{name}:{line}: "{word}": {advice}' for line, word, advice in here]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [
        "Whoever asks",
        "drawn anew.",
        "is left away here",
        "give or\n    take 3",
        "a dear step",
        "it says it\n# all",
    ],
)
def test_words_are_recognised(text: str) -> None:
    assert len(uses(text, WORDS)) == 1


@pytest.mark.parametrize("text", ["however", "renewed", "left a way out", "endearing", "give and take"])
def test_other_words_are_left_alone(text: str) -> None:
    assert uses(text, WORDS) == []
