"""The commands and where they live; a command's module is imported when it runs."""

from cyclopts import App


def version() -> str:
    """Return the version of the installed package."""
    from importlib.metadata import version as installed  # noqa: PLC0415 - rarely asked for

    return f"handeye {installed('handeye')}"


def make_app() -> App:
    """Return the command line as a whole."""
    app = App(
        name="handeye",
        help="Hand-eye calibration that says which view to take next, when to stop, and how far to trust it.",
        help_format="plaintext",
        help_epilogue="handeye COMMAND --help explains a command. Exit codes: 0 good, 1 mistake in handeye, "
        "2 usage, 3 unusable input, 4 degenerate geometry, 5 failed detection, 6 not solved, 7 cannot write, "
        "130 interrupted.",
        version=version,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    app.command("handeye.cli.solve:solve", name="solve", help="Calibrate from a folder of views.")
    app.command("handeye.cli.plan:plan", name="plan", help="Rank the views to take next.")
    app.command("handeye.cli.validate:validate", name="validate", help="Test how far a calibration holds.")
    app.command(
        "handeye.cli.importing:import_folder",
        name="import",
        help="Turn a folder of images and poses into a recording.",
    )
    app.command("handeye.cli.demo:demo", name="demo", help="Show what choosing views is worth.")
    app.command("handeye.cli.study:study", name="study", help="Compare the policies on public data.")
    return app
