"""Units that people read beside those of the inside, metres and radians."""

MM_PER_M = 1000.0
