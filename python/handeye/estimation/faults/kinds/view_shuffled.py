"""Images filed with the robot poses of other views."""

from collections.abc import Sequence

from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.estimation.faults.kinds.words import MOST_LISTED, listed
from handeye.types.calibration import Finding

KIND = Kind(
    "view_shuffled",
    "images filed with the poses of other views",
    "Two files were swapped, or one of the lists begins later, lacks a line or is sorted another way "
    "(`view_10` before `view_2`).",
    "An image that does not fit its own robot pose fits that of another view.",
    Handling.USED,
    "Pair each image with the robot pose at which it was taken; `solve` refuses where most are wrong.",
    "pairs the images with the poses that they fit; what fits none is left out",
)


def pairing_words(image: str, motion: str) -> str:
    """Say which robot pose an image belongs to."""
    return f"the picture of {image} was taken at the robot pose of {motion}"


def shuffled_words(names: Sequence[str], pairs: Sequence[tuple[int, int]]) -> str:
    """Say which images were filed with the wrong poses."""
    involved = [names[k] for k in sorted({k for pair in pairs for k in pair})]
    words = shift_of(dict(pairs), len(names)) or "; ".join(
        pairing_words(names[image], names[motion]) for image, motion in pairs[:MOST_LISTED]
    )
    return f"{listed(involved)}: images and robot poses are paired wrongly ({words})"


def shuffled_finding(names: Sequence[str], pairs: Sequence[tuple[int, int]], *, applied: bool) -> Finding:
    """Name images that were filed with the wrong poses."""
    done = "they were paired again and used" if applied else "what could not be paired again was left out"
    return Finding(
        KIND.code,
        f"{shuffled_words(names, pairs)}; {done}",
        {
            "views": [names[k] for k in sorted({k for pair in pairs for k in pair})],
            "pose_of_image": {names[image]: names[motion] for image, motion in pairs},
            "applied": applied,
        },
    )


def shift_of(pairing: dict[int, int], count: int) -> str:
    """Say in words what a pairing of images to poses has in common, empty if nothing."""
    if len(pairing) < 3:
        return ""
    steps = {(motion - image) % count for image, motion in pairing.items()}
    if len(steps) == 1:
        step = steps.pop()
        step = step if step <= count // 2 else step - count
        if step == 0:
            return ""
        return f"the list of images is shifted by {abs(step)} against that of the poses"
    if {image + motion for image, motion in pairing.items()} == {count - 1}:
        return "one of the lists is in reverse order"
    return ""
