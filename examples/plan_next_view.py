"""Choose the next view as ask and tell: the loop knows no robot, so any robot will do.

Here the world is the recording that comes with the package: "driving there" looks the view up. With an arm,
replace `take` by moving to the pose, taking a picture, and detecting the target in it.
"""

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.estimation import Measurements, make_estimator
from handeye.planning import Accuracy, Candidate, Planner, PlannerOptions, Pool, Stop
from handeye.planning.prediction import Sight
from handeye.types import View
from handeye.types.calibration import ModelName

recording = read_recording(shipped_recording()).recording


def take(candidate: Candidate) -> View:
    """Be the world."""
    return recording.view(candidate.name)


start = recording.select(["im_01", "im_10", "im_20"])
planner = Planner(
    Measurements.of_recording(start),
    Pool.of_views(recording.views),
    make_estimator(ModelName.AUTO),
    PlannerOptions(
        stop_rules=(Accuracy(sigma_translation_mm=0.1, sigma_rotation_deg=0.01),),
        # These candidates are known to show the target; else the planner asks that all of it is in the image.
        sight=Sight(known=True),
    ),
)

while not isinstance(answer := planner.ask(), Stop):
    verdict = planner.tell(take(answer.candidate))
    covariance = verdict.estimate.hand_eye_covariance
    sigma_mm = 1e3 * covariance[:3, :3].trace() ** 0.5
    print(
        f"{answer.candidate.name}: predicted gain {verdict.predicted_gain:5.2f}, "
        f"realised {verdict.realised_gain:5.2f} nats, now {sigma_mm:.3f} mm"
    )

print(f"stopped: {answer.sentence}")
