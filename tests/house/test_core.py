"""The core stays mathematics: clippy refuses files, clock and printing; here is what it is built from."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "crates" / "handeye-core"


def manifest() -> dict[str, dict[str, object]]:
    return tomllib.loads((CORE / "Cargo.toml").read_text())


def test_core_depends_on_linear_algebra_only() -> None:
    assert set(manifest()["dependencies"]) == {"nalgebra"}
    assert "build-dependencies" not in manifest()
    assert "target" not in manifest()


def test_linear_algebra_brings_no_random_numbers() -> None:
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    nalgebra = workspace["dependencies"]["nalgebra"]
    assert nalgebra["default-features"] is False
    assert not [feature for feature in nalgebra["features"] if "rand" in feature]


def test_clippy_refuses_the_world_in_the_core() -> None:
    settings = tomllib.loads((CORE / "clippy.toml").read_text())
    refused = {entry["path"] for kind in settings.values() for entry in kind}
    assert {"std::fs::File", "std::time::Instant", "std::time::SystemTime", "std::env::var"} <= refused
    allowed = [path for path in (CORE / "src").rglob("*.rs") if "clippy::disallowed" in path.read_text()]
    assert not allowed, allowed
