"""Candidates, fits and the rules by which explanations are selected; knows no machine."""
