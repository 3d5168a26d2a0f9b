"""What a page is told of several cameras: each camera and target as if alone, put together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from handeye.estimation import RigEstimate, RigMeasurements
from handeye.estimation.confidence import Within
from handeye.robots import Arm
from handeye.ui import documents
from handeye.ui.documents import Shown, curve_of

# How a view of one camera is named on the page.
_BETWEEN = " / "


@dataclass(frozen=True, eq=False)
class ShownRig:
    """Everything that a page shows of several cameras.

    Parameters
    ----------
    parts
        What each camera saw of each target, by the names of the two.
    within
        How accurately each camera is known, by its name; those that are determined.
    known
        The curve of each camera: stations, and the radii in mm and deg that were stated after so many.
    open, sentence
        What the stations leave open, and what explains the misfit.
    looked
        Whose picture is the last one; None before the first.
    """

    parts: Mapping[tuple[str, str], Shown]
    within: Mapping[str, Within] = field(default_factory=dict[str, Within])
    known: Mapping[str, tuple[tuple[int, float, float], ...]] = field(
        default_factory=dict[str, tuple[tuple[int, float, float], ...]]
    )
    asked: tuple[float, float] | None = None
    open: tuple[str, ...] = ()
    sentence: str | None = None
    looked: tuple[str, str] | None = None

    def named(self, camera: str, target: str, view: str) -> str:
        """Return how a view is named on the page; with the target where its camera saw several."""
        several = sum(one == camera for one, _ in self.parts) > 1
        return _BETWEEN.join([camera, target, view] if several else [camera, view])

    def find(self, name: str) -> tuple[Shown, str] | None:
        """Return the part that a view belongs to by its name on the page, and its name there."""
        for (camera, target), part in self.parts.items():
            for view in part.views:
                if self.named(camera, target, view.name) == name:
                    return part, view.name
        return None

    @property
    def stations(self) -> int:
        """The number of stations."""
        return len({view.name for part in self.parts.values() for view in part.views})


def shown_rig(
    measurements: RigMeasurements,
    estimate: RigEstimate | None,
    arm: Arm | None,
    rejected: Callable[[str, str], dict[str, str]],
    *,
    known: Mapping[str, tuple[tuple[int, float, float], ...]] | None = None,
    asked: tuple[float, float] | None = None,
) -> ShownRig:
    """Return what a page shows of a rig.

    Parameters
    ----------
    estimate
        What is believed; None while nothing is.
    arm
        The arm, if every station has joint positions.
    rejected
        Gives the views that are not used of a camera and a target, with the reason.
    """
    parts: dict[tuple[str, str], Shown] = {}
    for (camera, target), measured in measurements.pairs.items():
        if not measurements.moves(camera, target):
            continue
        parts[camera, target] = Shown(
            measured.mounting,
            measured.camera,
            measured.target,
            arm,
            measured.views,
            rejected=rejected(camera, target),
        )
    shown = ShownRig(parts, known=known or {}, asked=asked)
    return shown if estimate is None else with_belief(shown, estimate)


def with_belief(rig: ShownRig, estimate: RigEstimate) -> ShownRig:
    """Return what a page shows of a rig with what is believed of it now."""
    measurements = estimate.fit.measurements
    parts = {
        names: replace(
            part,
            estimate=estimate.of_pair(*names),
            rejected={**part.rejected, **measurements.pairs[names].rejected},
        )
        if names in measurements.pairs
        else part
        for names, part in rig.parts.items()
    }
    cameras = [name for name in measurements.cameras if not estimate.unobservable[name]]
    still_open = tuple(
        f"{name}: {one.sentence}" for name, found in estimate.unobservable.items() for one in found
    )
    within = {name: estimate.of_camera(name).within_95 for name in cameras}
    return replace(rig, parts=parts, within=within, open=still_open, sentence=estimate.attribution.sentence)


def scene(rig: ShownRig) -> dict[str, Any]:
    """Return what stands where: every camera and every target once, the views of all."""
    together: dict[str, Any] | None = None
    seen: set[tuple[str, str]] = set()
    for (camera, target), part in rig.parts.items():
        one = documents.scene(part)
        names = {"cameras": camera, "boards": target}
        if together is None:
            together = one | {"cameras": [], "boards": [], "views": [], "ellipsoids": []}
        for kind, name in names.items():
            if (kind, name) not in seen:
                seen.add((kind, name))
                together[kind] += [thing | {"name": name} for thing in one[kind]]
                if kind == "cameras":
                    together["ellipsoids"] += [e | {"name": name} for e in one["ellipsoids"][:1]]
        together["views"] += [v | {"name": rig.named(camera, target, v["name"])} for v in one["views"]]
    return together or documents.scene(next(iter(rig.parts.values())))


def candidates(rig: ShownRig) -> dict[str, Any]:
    """Return where the flange, with what is on it, could go next."""
    return documents.candidates(next(iter(rig.parts.values())))


def knowledge(rig: ShownRig) -> dict[str, Any]:
    """Return how accurate each camera is, and what limits the one that is known least."""
    now = [{"name": name, **within.to_dict()} for name, within in rig.within.items()]
    least = max(rig.within, key=lambda name: rig.within[name].translation_mm, default=None)
    part = next((part for (camera, _), part in rig.parts.items() if camera == least), None)
    return {
        "now": now,
        "asked": None if rig.asked is None else dict(zip(("mm", "deg"), rig.asked, strict=True)),
        "curves": [curve_of(name, known) for name, known in rig.known.items()],
        "gains": [],
        "shares": [] if part is None else documents.shares_of(part),
        "shares_of": least,
        "sentence": rig.sentence,
        "open": list(rig.open),
    }


def views(rig: ShownRig) -> dict[str, Any]:
    """Return the views of all cameras, and where in its picture each has seen targets."""
    rows: list[dict[str, Any]] = []
    rejected: list[dict[str, str]] = []
    coverage: dict[str, dict[str, Any]] = {}
    for (camera, target), part in rig.parts.items():
        one = documents.views(part)
        rows += [
            row | {"name": rig.named(camera, target, row["name"]), "station": row["name"]}
            for row in one["views"]
        ]
        rejected += [row | {"name": rig.named(camera, target, row["name"])} for row in one["rejected"]]
        cells = one["coverage"][0]["cells"]
        if camera in coverage:
            before = coverage[camera]["cells"]
            cells = [[a + b for a, b in zip(x, y, strict=True)] for x, y in zip(before, cells, strict=True)]
        coverage[camera] = {"name": camera, "cells": cells}
    order = list(dict.fromkeys(sorted(row["station"] for row in rows)))
    rows.sort(key=lambda row: order.index(row["station"]))
    return {"views": rows, "rejected": rejected, "coverage": list(coverage.values())}


def picture(rig: ShownRig) -> dict[str, Any] | None:
    """Return what is drawn over the last picture of all cameras, None without one."""
    if rig.looked is None:
        return None
    drawn = documents.picture(rig.parts[rig.looked])
    return None if drawn is None else drawn | {"label": rig.named(*rig.looked, drawn["label"])}


def picture_of_view(rig: ShownRig, name: str) -> dict[str, Any] | None:
    """Return what is drawn over the picture of a view of a camera."""
    found = rig.find(name)
    if found is None:
        return None
    drawn = documents.picture_of_view(*found)
    return None if drawn is None else drawn | {"label": name}
