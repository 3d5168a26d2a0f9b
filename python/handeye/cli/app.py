"""The commands and where they live; a command's module is imported when it runs."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import cast

from cyclopts import App, Parameter

# No length, angle, time or number of pixels is larger.
LARGEST = 1e12
# Name, where it is, and the line that lists it; its own help is its docstring.
COMMANDS = (
    ("run", "handeye.cli.run:run", "Drive the arm from view to view until the answer is good enough."),
    ("solve", "handeye.cli.solve:solve", "Calibrate from a folder of views."),
    ("doctor", "handeye.cli.doctor:doctor", "Say what is wrong with a folder of views, and repair a copy."),
    ("ui", "handeye.cli.ui:ui", "Open the page in the browser, on a folder or a simulated cell."),
    ("expect", "handeye.cli.expect:expect", "Say what accuracy to expect of a cell before it is built."),
    ("plan", "handeye.cli.plan:plan", "Rank the views to take next."),
    ("validate", "handeye.cli.validate:validate", "Test how far a calibration holds."),
    ("replay", "handeye.cli.replay:replay", "Go through old data: what each view brought."),
    ("check", "handeye.cli.check:check", "Test whether camera, board and arm still are where they were."),
    ("verify", "handeye.cli.verify:verify", "Compare a calibration with points that were touched."),
    ("diff", "handeye.cli.diff:diff", "Say how two calibrations of one camera differ."),
    ("arm", "handeye.cli.corrected:corrected", "Write the arm as it is built, as the views have it."),
    ("import", "handeye.cli.importing:import_folder", "Turn images and robot poses into a recording."),
    ("export", "handeye.cli.export:export", "Write the answer in the format of another program."),
    ("report", "handeye.cli.report:report", "Write one page about a calibration."),
    ("detect", "handeye.cli.detect:detect_in", "Say what is seen in each picture, and draw it."),
    ("devices", "handeye.cli.devices:devices", "List drivers of robots and cameras, and what each sees."),
    ("target", "handeye.cli.target:target", "Write a calibration target to print."),
    ("demo", "handeye.cli.demo:demo", "Show what choosing views is worth."),
    ("study", "handeye.cli.study:study", "Compare policies and models on public data."),
    ("bench", "handeye.cli.bench:bench", "Measure speed on this machine, beside other libraries."),
)


def version() -> str:
    """Return the version of the installed package."""
    from importlib.metadata import version as installed  # noqa: PLC0415 - rarely asked for

    return f"handeye {installed('handeye')}"


def _check_numbers(kind: object, value: object) -> None:
    """Refuse numbers that no quantity has, in options of numbers and in groups of options."""
    if isinstance(value, tuple | list):
        for one in cast("Sequence[object]", value):
            _check_numbers(kind, one)
    elif is_dataclass(value):
        for field in fields(value):
            try:
                _check_numbers(kind, getattr(value, field.name))
            except ValueError as error:
                raise ValueError(f"--{field.name.replace('_', '-')}: {error}") from error
    elif isinstance(value, float) and not abs(value) <= LARGEST:
        raise ValueError(f"{value:g}, expected a number of at most {LARGEST:g} either way")


def make_app(named: str = "") -> App:
    """Return the command line as a whole; the command that is named explains itself."""
    app = App(
        name="handeye",
        help="Hand-eye calibration that says which view to take next, when to stop, and how far to trust it.",
        # Markdown joins the lines of a docstring; it takes a while to load, and the list has none.
        help_format="markdown" if named else "plaintext",
        help_epilogue="handeye COMMAND --help explains a command. Exit codes: 0 good, 1 mistake in handeye, "
        "2 usage, 3 unusable input, 4 degenerate geometry, 5 failed detection, 6 not solved, "
        "7 cannot write, 8 robot or camera failed, 9 something has moved or is not as stated, "
        "130 interrupted.",
        version=version,
        default_parameter=Parameter(negative=(), validator=_check_numbers),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    for order, (name, place, line) in enumerate(COMMANDS):
        app.command(place, name=name, help=None if name == named else line, sort_key=order)
    return app
