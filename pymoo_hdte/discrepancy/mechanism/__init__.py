"""Measured records of any lumped mechanism: what its model lacks, named and proved."""

from pymoo_hdte.discrepancy.mechanism.analysis import Finding, investigate

__all__ = ["Finding", "investigate"]
