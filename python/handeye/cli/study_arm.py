"""`handeye study arm`: whether an arm that was put right is nearer to the truth where nobody looked."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Effort, write_results
from handeye.studies.arm import ArmStudy, study_arm

if TYPE_CHECKING:
    from rich.console import Console


def arm(
    *,
    arms: int = ArmStudy.arms,
    views: int = ArmStudy.views,
    postures: int = ArmStudy.postures,
    effort: Effort = Effort(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Compare arms with wrong links, as described and as put right, with the truth at unseen postures.

    Views are planned for it one by one. Errors of the tool are counted up to a motion of base and flange,
    which no view tells.

    Parameters
    ----------
    arms
        How many.
    views
        Views of each.
    postures
        Unseen postures of each.
    """
    check_folder(effort.output)
    with progress("Putting arms right") as advance:
        document = study_arm(
            ArmStudy(arms=arms, views=views, postures=postures, seed=effort.seed),
            workers=effort.crew,
            progress=advance,
        )
    written = write_results(effort.output, "arm", document, lambda: ())
    return Answer(document, lambda console: _show(console, document, written))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415

    heading(console, f"{document['arms']} arms with wrong links", f"{document['views']} planned views each")
    before, after = figures(document["described_mm"]), figures(document["corrected_mm"])
    rows = [
        (
            "tool off by",
            f"{before} mm as described, {after} mm put right: {document['ratio']:.1f} times less",
        ),
        ("within what is stated", f"{document['held']:.1%}"),
    ]
    pairs(console, rows, indent=2)
    tables.show_written(console, written)
