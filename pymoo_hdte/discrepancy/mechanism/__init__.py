"""Measured records of any lumped mechanism: missing effects of its model, named and validated."""
