"""How good a calibration is, and studies that compare policies, models and claims with the truth."""
