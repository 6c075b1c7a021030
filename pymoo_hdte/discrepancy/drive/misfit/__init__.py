"""Location of the misfit of a drive: its map, the flagged cells, and both in words."""
