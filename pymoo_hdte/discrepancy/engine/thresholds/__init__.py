"""Thresholds of `Rules` by what they are of, and the fields in which each tells its derivation."""
