"""Views that leave directions of the answer open."""

from handeye.estimation.faults.kinds.base import Handling, Kind

KIND = Kind(
    "degenerate",
    "too little rotation",
    "All views share one orientation or one axis of rotation, as with an arm of four axes or a careful hand.",
    "The information that the views give has directions known worse than 0.1 m or 0.1 rad.",
    Handling.REFUSED,
    "Add views turned by 20 degrees or more about two different axes; `handeye plan` proposes them. With "
    "`--reduced` the rest is answered.",
)
