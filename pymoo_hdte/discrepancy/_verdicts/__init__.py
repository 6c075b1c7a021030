"""The order of the steps to a verdict for each kind of machine, and its validation."""
