"""Blind campaigns: which hidden effects of a virtual rig the discrepancy workflow finds."""
