"""Compare ways of choosing views on a recording with known truth: same starts, same number of views."""

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.studies.comparison import POLICIES, Comparison, compare
from handeye.studies.protocol import Protocol
from handeye.types.calibration import ModelName

recording = read_recording(shipped_recording()).recording
protocol = Protocol(trials=2, start_views=3, added_views=5, seed=1)

for model in ModelName:
    (result,) = compare([recording], Comparison(protocol, model))
    print(f"model {model}, {protocol.trials} random starts: mean error of the camera's position in mm")
    for policy in POLICIES:
        errors = result.values(policy, "translation_mm").mean(axis=0)
        row = "  ".join(f"{error:6.2f}" for error in errors)
        print(f"  {policy:<15}{row}   (after 3, 4, ... 8 views)")
