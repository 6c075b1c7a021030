"""Measured records of any lumped mechanism: what its model lacks, named and proved."""
