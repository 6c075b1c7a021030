"""Blind campaigns: what the discrepancy workflow finds of what a virtual rig hides."""
