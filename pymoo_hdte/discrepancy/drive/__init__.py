"""Comparison of a harmonic drive's campaign with its model, from evidence to validation."""
