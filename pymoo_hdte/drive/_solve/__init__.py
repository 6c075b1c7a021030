"""Solvers of the drive's equations of motion: steady states, stability, time integration."""
