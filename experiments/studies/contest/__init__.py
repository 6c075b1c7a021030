"""Runs of multi-objective algorithms, ours and others', on benchmark problems, as jobs."""
