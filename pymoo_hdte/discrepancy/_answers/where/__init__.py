"""Where model and records disagree: the map, its flagged cells, and both in words."""
