"""Benchmarks: solver, scorer and a planning step on this machine, beside other ways to the same."""
