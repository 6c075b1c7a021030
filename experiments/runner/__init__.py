"""Which experiments there are, their stored outcomes, provenance and report."""
