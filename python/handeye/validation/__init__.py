"""How far a calibration of given views holds, and how good it is where the truth is known."""
