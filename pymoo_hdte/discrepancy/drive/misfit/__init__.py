"""Where the misfit of a drive lives: its map, the places it is in, and both in words."""
