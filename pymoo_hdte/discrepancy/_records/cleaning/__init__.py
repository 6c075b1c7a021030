"""Faulty rows of records, and their noise: found, repaired or left out, and counted."""
