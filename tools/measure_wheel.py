"""What a wheel holds, and what its drivers cost those who import the package and drive nothing.

Bytes by room, packed as in the wheel and unpacked; with `--imports` the instructions that imports take
(callgrind), with the drivers, what they talk through and the shipped tests, and without. Instructions are
the same on a busy machine.

python tools/measure_wheel.py dist/*.whl --imports
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from zipfile import ZipFile

DRIVERS = ("robots/drivers", "cameras/drivers", "ros", "testing")
IMPORTS = ("import handeye", "import handeye; handeye.solve", "from handeye.cli import main")


def rooms(wheel: Path) -> None:
    """Print the bytes of each room, largest first."""
    packed: Counter[str] = Counter()
    plain: Counter[str] = Counter()
    with ZipFile(wheel) as archive:
        for each in archive.infolist():
            place = each.filename.split("/")
            room = next((name for name in DRIVERS if "/".join(place[1:]).startswith(f"{name}/")), None)
            room = room or "/".join(place[: 2 if len(place) > 2 or "_core" in place[1] else 1])
            packed[room] += each.compress_size
            plain[room] += each.file_size
    print(f"{wheel.name}: {wheel.stat().st_size:,} bytes, unpacked {plain.total():,}")
    for room, size in packed.most_common():
        print(f"  {room:<28} {size:>10,} {plain[room]:>11,}")
    cost = sum(packed[name] for name in DRIVERS)
    print(f"  drivers and shipped tests: {cost:,} bytes, {cost / packed.total():.1%}")


def instructions(folder: Path, statement: str) -> int:
    """Count what an import takes, its modules compiled before."""
    environment = os.environ | {"PYTHONPATH": str(folder), "PYTHONHASHSEED": "0"}
    command = [sys.executable, "-c", statement]
    subprocess.run(command, env=environment, check=True)
    counted = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *command]
    done = subprocess.run(counted, env=environment, check=True, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    assert found, done.stderr
    return int(found[1])


def imports(wheel: Path) -> None:
    """Print what imports take with the drivers and without."""
    with tempfile.TemporaryDirectory() as temporary:
        whole, bare = Path(temporary) / "whole", Path(temporary) / "bare"
        for folder in (whole, bare):
            with ZipFile(wheel) as archive:
                archive.extractall(folder)
        for name in DRIVERS:
            shutil.rmtree(bare / "handeye" / name)
        for statement in IMPORTS:
            with_drivers, without = (instructions(folder, statement) for folder in (whole, bare))
            more = with_drivers / without - 1
            print(f"  {statement:<32} {with_drivers:>13,} {without:>13,} {more:+.2%}", flush=True)


def main() -> None:
    """Measure each wheel."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("wheels", type=Path, nargs="+")
    parser.add_argument("--imports", action="store_true", help="count instructions of the first wheel")
    arguments = parser.parse_args()
    for wheel in arguments.wheels:
        rooms(wheel)
    if arguments.imports:
        imports(arguments.wheels[0])


if __name__ == "__main__":
    main()
