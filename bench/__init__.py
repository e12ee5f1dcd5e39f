"""Benchmarks: the solver beside its peers, how it grows, its answers to nasty problems, and the tick."""
