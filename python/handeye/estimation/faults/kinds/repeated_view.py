"""Views that are there twice."""

from dataclasses import replace

from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.estimation.faults.kinds.words import listed
from handeye.estimation.measurements import Measurements
from handeye.types.calibration import Finding

KIND = Kind(
    "view_repeated",
    "a view that is there twice",
    "A file was copied, or a program saved one picture and one pose several times.",
    "Pixels and robot pose are the same to the last digit: it says nothing new, yet would count.",
    Handling.LEFT_OUT,
    "Nothing: it counts once.",
    "leaves the copies out",
)

FEWEST_VIEWS = 3


def without_repeated(measurements: Measurements) -> tuple[Measurements, tuple[Finding, ...]]:
    """Leave out views that are copies of others, and name them."""
    first: dict[bytes, str] = {}
    copies: dict[str, str] = {}
    for view in measurements.views:
        what = view.T_base_flange.matrix.tobytes() + view.point_ids.tobytes() + view.pixels.tobytes()
        of = first.setdefault(what, view.name)
        if of != view.name:
            copies[view.name] = of
    if not copies:
        return measurements, ()
    if len(measurements) - len(copies) < FEWEST_VIEWS:
        return measurements, ()  # That the views are all alike says more.
    kept = [k for k, view in enumerate(measurements.views) if view.name not in copies]
    rejected = measurements.rejected | {name: f"the same as {of}" for name, of in copies.items()}
    originals = listed(list(dict.fromkeys(copies.values())))
    they = "they say nothing new and were" if len(copies) > 1 else "it says nothing new and was"
    finding = Finding(
        KIND.code,
        f"{listed(list(copies))}: pixels and robot pose are those of {originals} "
        f"to the last digit; {they} left out",
        {"views": list(copies), "same_as": copies},
    )
    return replace(measurements.select(kept), rejected=rejected), (finding,)
