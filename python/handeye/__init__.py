"""Hand-eye calibration: which view to take next, when to stop, and how far its answer can be trusted."""
