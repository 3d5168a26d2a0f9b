"""What the measures of a validation say in words, and which of them mislead: one function per finding.

Each looks at the numbers and says nothing where they give no cause. The thresholds are where a reader would
act: about a factor of two in a deviation, a fifth between two models.
"""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from handeye.types.calibration import Finding, ModelName

if TYPE_CHECKING:
    from handeye.validation.splits import ModelCheck

# Residuals this many times the noise in the images come from elsewhere.
NOT_FROM_PIXELS = 3.0
# A measure that differs by less between two models, or two kinds of halves, says nothing.
NOTABLE_RATIO = 1.2
CONTIGUOUS_RATIO = 2.0
# NEES over its degrees of freedom: deviations 1.6 times too small, or too large.
NEES_TOO_HIGH = 2.5
NEES_TOO_LOW = 0.4
FEW_VIEWS_IN_A_HALF = 6


def findings(chosen: ModelName, checks: Mapping[ModelName, "ModelCheck"]) -> Iterator[Finding]:
    """Say what is to be said of the chosen model, with the other one to compare."""
    check = checks[chosen]
    others = [other for model, other in checks.items() if model is not chosen]
    yield from _halves(check)
    yield from _covariance(check)
    yield from _contiguous(check)
    yield from _residuals(check)
    for other in others:
        yield from _contradiction(check, other)
    yield from _shared(check)


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _halves(check: "ModelCheck") -> Iterator[Finding]:
    if not check.random_halves:
        yield Finding(
            "halves_undetermined",
            "no half of the views determines the answer by itself, so agreement cannot be tested: take more "
            "views, turned about several axes",
            {"undetermined": check.undetermined},
        )
        return
    translation, rotation = _mean(check.halves("translation_mm")), _mean(check.halves("rotation_deg"))
    # A half has half of the views, and the difference the errors of both: twice the deviation of all views.
    yield Finding(
        "split_half",
        f"random halves differ by {translation:.2g} mm and {rotation:.2g} deg on average, so expect about "
        f"{translation / 2:.2g} mm and {rotation / 2:.2g} deg of chance in the answer from all views",
        {"translation_mm": translation, "rotation_deg": rotation, "halvings": len(check.random_halves)},
    )
    used = len(check.estimate.noise.pixel_sigma_px) // 2
    if used < FEW_VIEWS_IN_A_HALF:
        yield Finding(
            "few_views",
            f"a half has only {used} views, so halves vary much more than the answer from all of them",
            {"views_in_a_half": used},
        )
    if check.undetermined:
        yield Finding(
            "some_halves_undetermined",
            f"{check.undetermined} of {check.undetermined + len(check.random_halves)} halvings leave the "
            "answer open and are left out, so the figures flatter halves",
            {"undetermined": check.undetermined},
        )


def _covariance(check: "ModelCheck") -> Iterator[Finding]:
    truth = check.truth
    if truth is not None and not truth.in_region_95:
        yield Finding(
            "truth_outside",
            f"the truth lies outside the 95 % region: the answer is {truth.translation_mm:.2g} mm and "
            f"{truth.rotation_deg:.2g} deg off, NEES/6 {truth.nees_per_dof:.2g} (1 is ideal)",
            truth.to_dict(),
        )
    nees = _mean(check.halves("nees_per_dof"))
    if nees > NEES_TOO_HIGH:
        yield Finding(
            "covariance_too_small",
            f"halves differ {np.sqrt(nees):.2g} times as much as their covariances allow (NEES/6 {nees:.2g})"
            ": do not rely on the stated accuracy",
            {"nees_per_dof": nees},
        )
    elif nees < NEES_TOO_LOW:
        yield Finding(
            "covariance_large",
            f"halves agree {1 / np.sqrt(nees):.2g} times better than their covariances say (NEES/6 "
            f"{nees:.2g}): the stated accuracy allows for errors that all halves share, which halves cannot "
            "show",
            {"nees_per_dof": nees},
        )


def _contiguous(check: "ModelCheck") -> Iterator[Finding]:
    contiguous = check.contiguous_halves
    if contiguous is None:
        yield Finding(
            "contiguous_undetermined",
            "the first and the last half of the views do not both determine the answer: their order groups "
            "alike poses, and agreement over time cannot be tested",
        )
        return
    usual = _mean(check.halves("translation_mm"))
    if contiguous.translation_mm > CONTIGUOUS_RATIO * usual:
        yield Finding(
            "contiguous_disagree",
            f"the first and the last half differ by {contiguous.translation_mm:.2g} mm, random halves by "
            f"{usual:.2g} mm: the error changes slowly with the pose or with time (an arm that is not "
            "calibrated, warming up, something that slipped), and random halves make it look too small",
            {"contiguous_mm": contiguous.translation_mm, "random_mm": usual},
        )


def _residuals(check: "ModelCheck") -> Iterator[Finding]:
    pixel = float(np.sqrt(2 * np.mean(np.square(check.estimate.noise.pixel_sigma_px))))
    if check.rmse_px > NOT_FROM_PIXELS * pixel:
        yield Finding(
            "residuals_are_the_robots",
            f"residuals are {check.rmse_px:.2g} px where the images are good to {pixel:.2g} px: nearly all "
            "of it is the robot (or camera and target), so small residuals would not mean a good answer",
            {"rmse_px": check.rmse_px, "image_noise_px": pixel},
        )


def _contradiction(check: "ModelCheck", other: "ModelCheck") -> Iterator[Finding]:
    if not (check.random_halves and other.random_halves and check.held_out and other.held_out):
        return
    unseen = _mean(check.unseen("rmse_px")) / _mean(other.unseen("rmse_px"))
    halves = _mean(check.halves("translation_mm")) / _mean(other.halves("translation_mm"))
    evidence = {
        "held_out_rmse_px": {c.model.value: _mean(c.unseen("rmse_px")) for c in (check, other)},
        "split_half_mm": {c.model.value: _mean(c.halves("translation_mm")) for c in (check, other)},
    }
    if unseen > NOTABLE_RATIO and halves < 1 / NOTABLE_RATIO:
        yield Finding(
            "held_out_misleads",
            f"held-out residuals prefer model {other.model} ({unseen:.2g} times smaller), but its halves "
            f"differ {1 / halves:.2g} times as much: it bends to follow the robot's error, which the held-"
            "out views share. Believe the halves",
            evidence,
        )
    elif unseen < 1 / NOTABLE_RATIO and halves > NOTABLE_RATIO:
        yield Finding(
            "held_out_flatters",
            f"halves agree {halves:.2g} times better under model {other.model}, though model {check.model} "
            f"has the smaller held-out residuals ({1 / unseen:.2g} times): these may come from following the "
            "robot's error. Believe the halves",
            evidence,
        )
    elif halves > NOTABLE_RATIO and unseen > NOTABLE_RATIO:
        yield Finding(
            "other_model_better",
            f"model {other.model} agrees better with itself ({halves:.2g} times) and predicts better "
            f"({unseen:.2g} times): use it for these views",
            evidence,
        )


def _shared(check: "ModelCheck") -> Iterator[Finding]:
    if check.truth is None:
        yield Finding(
            "shared_errors",
            "no split shows what all views share: a wrong size of the target or a wrong camera calibration "
            "moves every half alike",
        )
