"""Candidates, fits and the rules of a verdict; knows no machine."""
