"""Where iterations end that leave it to the caller."""

COST_TOLERANCE = 1e-6
"""A step that lowers the cost by less, relatively, is the last: the rule of Ceres as it is shipped."""
MOST_STEPS = 100
