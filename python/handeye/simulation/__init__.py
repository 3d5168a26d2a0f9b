"""Cells that are made up, with everything wrong at once as the world has it."""
