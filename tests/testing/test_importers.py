"""The shipped tests of importers: ours pass, and each rule finds the importer that breaks it."""

from dataclasses import replace
from pathlib import Path

import pytest

from datasets.layouts import write_rct, write_rwhe
from handeye.datasets import IMPORTERS, Importer, ImportOptions
from handeye.datasets.importer import Imported
from handeye.testing import ImporterTests
from rules import rules_of

OPTIONS = ImportOptions(pattern=(3, 4))
RWHE = IMPORTERS["rwhe-calib"]


class TestOurs(ImporterTests):
    @pytest.fixture(params=[("rwhe-calib", write_rwhe), ("robot_cal_tools", write_rct)], ids=lambda p: p[0])
    def made(self, request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Importer, Path]:
        name, write = request.param
        return IMPORTERS[name], write(tmp_path / "made")

    @pytest.fixture
    def importer(self, made: tuple[Importer, Path]) -> Importer:
        return made[0]

    @pytest.fixture
    def layout(self, made: tuple[Importer, Path]) -> Path:
        return made[1]

    @pytest.fixture
    def options(self) -> ImportOptions:
        return OPTIONS


def reads_nothing(folder: Path, options: ImportOptions) -> Imported:
    return None  # type: ignore[return-value]


def leaves_a_file(folder: Path, options: ImportOptions) -> Imported:
    (folder / "cache.txt").write_text("x")
    return RWHE.read(folder, options)


def trusts_its_files(folder: Path, options: ImportOptions) -> Imported:
    [float(word) for word in (folder / "RobotPosesVec.txt").read_text().split()]
    return RWHE.read(folder, options)


def opens_what_is_not_there(folder: Path) -> bool:
    return "im" in "".join(path.name for path in folder.iterdir())


BROKEN = [
    (replace(RWHE, read=reads_nothing), "test_knows_its_own"),
    (replace(RWHE, recognises=lambda _: False), "test_knows_its_own"),
    (replace(RWHE, recognises=lambda _: True), "test_leaves_others_alone"),
    (replace(RWHE, recognises=opens_what_is_not_there), "test_leaves_others_alone"),
    (replace(RWHE, read=leaves_a_file), "test_writes_nothing"),
    (replace(RWHE, read=trusts_its_files), "test_a_broken_file_is_an_input_error"),
]


@pytest.mark.parametrize(("importer", "rule"), BROKEN)
def test_each_rule_finds_the_importer_that_breaks_it(importer: Importer, rule: str, tmp_path: Path) -> None:
    layout = write_rwhe(tmp_path / "made")
    given = {"importer": importer, "layout": layout, "options": OPTIONS, "tmp_path": tmp_path / "work"}
    (tmp_path / "work").mkdir()
    test = getattr(ImporterTests(), rule)
    wanted = test.__code__.co_varnames[1 : test.__code__.co_argcount]
    with pytest.raises((AssertionError, ValueError, OSError)):
        test(**{name: given[name] for name in wanted})


def test_every_rule_of_importers_is_broken_by_somebody() -> None:
    assert {rule for _, rule in BROKEN} == rules_of(ImporterTests)
