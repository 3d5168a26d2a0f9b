"""How good a calibration is: metrics, and studies that compare policies, models and claims with truth."""
