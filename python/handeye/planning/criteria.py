"""The criterion that is used where nobody names one."""

from handeye import _core
from handeye.estimation.estimate import Estimate


def usual_criterion(estimate: Estimate, *, camera_too: bool = False) -> _core.Criterion:
    """Return what a view is worth: by how much the expected error of position and rotation falls.

    That is what is asked for and stated. While the views leave a direction open, or where the camera is to be
    learnt as well, it is the paper's entropy of all parameters.

    Parameters
    ----------
    estimate
        What is believed now.
    camera_too
        Whether the parameters of the camera are asked for, and not only its pose.
    """
    return _core.Criterion("entropy" if camera_too or not estimate.determined else "accuracy")
