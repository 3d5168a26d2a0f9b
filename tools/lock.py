"""Resolve requirements/*.txt from pyproject.toml, with hashes and without addresses.

Run by `make lock`. The resolver lives in a throw-away environment, so nobody needs it for anything else.
"""

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RESOLVER = "uv==0.13.9"
OPTIONS = [
    "--universal",
    "--python-version=3.11",
    "--fork-strategy=fewest",
    "--generate-hashes",
    "--no-annotate",
    "--custom-compile-command=make lock",
    "--quiet",
]


def resolve(uv: Path, output: str, groups: list[str], constraints: str, extras: tuple[str, ...] = ()) -> None:
    """Write `output`: the package's own dependencies, those of groups and extras, within constraints."""
    command = [str(uv), "pip", "compile", "pyproject.toml", *OPTIONS, f"--constraints={constraints}"]
    command += [f"--group={group}" for group in groups] + [f"--extra={extra}" for extra in extras]
    if "--upgrade" in sys.argv[1:]:
        command.append("--upgrade")
    subprocess.run([*command, f"--output-file={output}"], cwd=ROOT, check=True)
    addresses = [line for line in (ROOT / output).read_text().splitlines() if "://" in line]
    if addresses:
        sys.exit(f"{output} names an address; it must not be committed so: {addresses[0]}")


def main() -> None:
    """Resolve the full set first, then the others inside it, so that all name the same versions."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        bin_folder = Path(folder) / ("Scripts" if os.name == "nt" else "bin")
        pip = [str(bin_folder / "python"), "-m", "pip", "install", "--quiet", RESOLVER]
        subprocess.run(pip, check=True)
        resolve(bin_folder / "uv", "requirements/dev.txt", ["dev", "docs"], "requirements/pins.txt")
        resolve(bin_folder / "uv", "requirements/run.txt", ["build"], "requirements/dev.txt")
        resolve(bin_folder / "uv", "requirements/bench.txt", ["build", "bench"], "requirements/dev.txt")
        # What `handeye study public` needs beside: other people's benchmark and renderer.
        extras = ("public", "sim")
        resolve(bin_folder / "uv", "requirements/public.txt", ["build"], "requirements/dev.txt", extras)


if __name__ == "__main__":
    main()
