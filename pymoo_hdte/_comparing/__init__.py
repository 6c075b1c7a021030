"""Algorithms compared on problems: runs, reference fronts, indicators, tests, ranks, Table 7."""
