"""Circles between the modules of a crate, and arrows that point up, are found; today there are none."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def check() -> ModuleType:
    spec = importlib.util.spec_from_file_location("check_modules", ROOT / "tools" / "check_modules.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def crate(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def circles(check: ModuleType, folder: Path, files: dict[str, str]) -> list[set[str]]:
    arrows = check.Crate(crate(folder, files)).uses()
    return [{check.name_of(module) for module in circle} for circle in check.all_circles(arrows)]


CIRCLES = {
    "by use": {"lib.rs": "mod a;\nmod b;", "a.rs": "use crate::b::B;", "b.rs": "use super::a::A;"},
    "by a path in the code": {
        "lib.rs": "mod a;\nmod b;",
        "a.rs": "fn f() -> u8 { crate::b::g() }",
        "b.rs": "use crate::a::f;",
    },
    "in braces over lines": {
        "lib.rs": "pub mod a;\npub mod b;",
        "a.rs": "use crate::{\n    b::{self, B as Other},\n};",
        "b.rs": "pub(crate) use crate::a::*;",
    },
    "through a re-export": {
        "lib.rs": "mod room;",
        "room/mod.rs": "mod a;\nmod b;\npub use b::B;",
        "room/a.rs": "use crate::room::B;",
        "room/b.rs": "use super::a::A;",
    },
    "of a parent and its child": {
        "lib.rs": "mod room;",
        "room.rs": "mod a;\nuse a::f;\npub struct Base;",
        "room/a.rs": "use super::Base;",
    },
    "of two folders": {
        "lib.rs": "mod a;\nmod b;",
        "a/mod.rs": "mod one;\nmod two;",
        "a/one.rs": "use crate::b::three::T;",
        "a/two.rs": "pub struct T;",
        "b/mod.rs": "pub mod three;\nmod four;",
        "b/three.rs": "pub struct T;",
        "b/four.rs": "use crate::a::two::T;",
    },
}

FREE = {
    "a straight line": {"lib.rs": "mod a;\nmod b;", "a.rs": "use crate::b::B;", "b.rs": "use std::fmt;"},
    "a parent that hands on": {
        "lib.rs": "mod room;",
        "room/mod.rs": "mod a;\nmod base;\npub use a::f;\npub use base::Base;",
        "room/a.rs": "use super::Base;",
        "room/base.rs": "pub struct Base;",
    },
    "tests only": {
        "lib.rs": "mod a;\nmod b;",
        "a.rs": "use crate::b::B;",
        "b.rs": "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n",
    },
    "words in comments and strings": {
        "lib.rs": "mod a;\nmod b;",
        "a.rs": "use crate::b::B;",
        "b.rs": '// As crate::a::f does.\nconst TEXT: &str = "crate::a::f";',
    },
    "another crate's names": {
        "lib.rs": "mod a;\nmod b;",
        "a.rs": "use crate::b::B;",
        "b.rs": "use a_crate::a::A;",
    },
}


@pytest.mark.parametrize("name", CIRCLES)
def test_circles_are_found(check: ModuleType, tmp_path: Path, name: str) -> None:
    assert circles(check, tmp_path, CIRCLES[name])


@pytest.mark.parametrize("name", FREE)
def test_what_is_no_circle_is_none(check: ModuleType, tmp_path: Path, name: str) -> None:
    assert circles(check, tmp_path, FREE[name]) == []


def test_arrows_up_and_rooms_without_a_layer_are_named(check: ModuleType, tmp_path: Path) -> None:
    files = {
        "lib.rs": "mod low;\nmod high;\nmod stray;\npub mod testing;",
        "low.rs": "use crate::high::H;\nuse crate::testing::Random;",
        "high.rs": "use crate::low::L;",
        "stray.rs": "pub struct S;",
        "testing.rs": "pub struct Random;",
    }
    arrows = check.Crate(crate(tmp_path, files)).uses()
    assert check.forbidden_arrows(arrows, [{"high"}, {"low"}]) == [
        "crate::low uses crate::high, which is not below it",
        "crate::low uses crate::testing, which is for tests",
        "stray is in no layer",
    ]


def test_the_crates_are_free_of_circles_and_arrows_up(
    check: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert check.main() == 0, capsys.readouterr().err
