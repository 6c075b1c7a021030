"""A campaign of a harmonic drive held against its model, from evidence to the proof."""
