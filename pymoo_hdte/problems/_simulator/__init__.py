"""Robust design of any simulator, on a surrogate that finds its own order."""
