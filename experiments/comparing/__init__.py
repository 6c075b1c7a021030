"""Seeded runs of algorithms: quality of their fronts, paired statistics, ranks and figures."""
