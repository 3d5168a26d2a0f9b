"""`handeye devices`: which drivers there are, what each of them sees, and what it would need."""

from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.session.devices import driver_reports

if TYPE_CHECKING:
    from rich.console import Console


def devices(*, common: Common = Common()) -> Answer:  # noqa: B008 - frozen
    """List the drivers of robots and cameras, the devices that each of them sees, and what it would need.

    Nothing moves, and no network is searched: arms are reached by their address. Whatever is listed under a
    driver is what --driver or --images takes, such as basler:40012345.
    """
    del common
    reports = driver_reports()
    data: dict[str, Any] = {
        "drivers": [
            {
                "kind": report.kind,
                "name": report.name,
                "package": report.package,
                "state": report.state.value,
                "detail": report.detail,
                "hint": report.hint,
                "devices": [{"address": where, "description": what} for where, what in report.devices],
            }
            for report in reports
        ]
    }

    def show(console: "Console") -> None:
        for kind, title in (("robot", "--driver"), ("camera", "--images")):
            console.print(title)
            for report in reports:
                if report.kind != kind:
                    continue
                said = report.detail if report.hint is None else f"{report.detail}; {report.hint}"
                line = f"  {report.name:<10} {report.state.value:<8} {said}"
                console.print(line, markup=False, highlight=False, soft_wrap=True)
                for where, what in report.devices:
                    line = f"  {'':<10} {report.name}:{where}  {what}"
                    console.print(line, markup=False, highlight=False, soft_wrap=True)

    return Answer(data, show)
