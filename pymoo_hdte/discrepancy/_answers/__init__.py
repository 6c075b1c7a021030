"""What follows from a verdict: the next test, the revised model, what stays open."""
