"""Touched points on disk: what is read, and what is refused with the place of the mistake."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets.touches import read_touches
from handeye.errors import InputError
from handeye.types.rig import Body

GOOD = """
sigma_mm = 0.1
notation = "ur"
unit = "mm"

[[tip]]
name = "tool"
at_mm = [0.0, 0.0, 150.0]
sigma_mm = 0.5

[[tip]]
name = "cone"
on = "base"

[[touch]]
tip = "tool"
point = 7
pose = "400, -100, 80, 0, 3.1416, 0"
joints_deg = [0, -90, 90, -90, -90, 0]

[[touch]]
tip = "tool"
point = "cone"
T_base_flange = [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def test_a_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "touches.toml"
    file.write_text(GOOD)
    found = read_touches(file)
    assert found.sigma_m == pytest.approx(1e-4)
    assert found.tips["tool"].at_m == (0.0, 0.0, 0.15)
    assert found.tips["cone"].body is Body.BASE
    first, second = found.touches
    np.testing.assert_allclose(first.T_base_flange.translation, [0.4, -0.1, 0.08])
    assert first.point == 7
    np.testing.assert_allclose(first.joints_rad, np.deg2rad([0, -90, 90, -90, -90, 0]))
    assert (second.point, second.joints_rad) == ("cone", None)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('notation = "ur"\n', "", "states no notation"),
        ("point = 7", "point = 7.5", "field touch"),
        ("sigma_mm = 0.5", "", "at_mm and sigma_mm go together"),
        ('name = "cone"', 'name = "tool"', "two tips named"),
        ("sigma_mm = 0.1", "sigma_mm = nan", "standard deviation"),
        ('pose = "400, -100, 80, 0, 3.1416, 0"\n', "", "one is needed"),
        ('pose = "400', 'pose = "4', "touch 1"),
        ("joints_deg = [0", "joints_rad = [0]\njoints_deg = [0", "one is enough"),
        ('tip = "tool"\npoint = 7', 'tip = "tol"\npoint = 7', "no tip 'tol'"),
        ("[[touch]]", "[[tuch]]", "unknown field"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    file = tmp_path / "touches.toml"
    text = GOOD.replace(old, new)
    if said == "touch 1":
        text = text.replace("4, -100, 80, 0, 3.1416, 0", "4, -100, 80")
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        read_touches(file)
