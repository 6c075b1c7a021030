"""What several experiments compare with, and their outcomes on disk."""
