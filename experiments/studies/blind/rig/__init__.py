"""A test bench of a harmonic drive, written from its physics alone: truth of the blind campaigns.

It shares no code with the package under test, and imports nothing of it.
"""
